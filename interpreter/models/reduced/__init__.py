"""Models of finite elements in a space of few fields: `words`, the `space`, its `training`, the `equations` in it."""
