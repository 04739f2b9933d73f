"""The site of `dsl board`: `page` puts it together from `matrix`, `figures` and `cards`."""
