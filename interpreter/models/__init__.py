from typing import Any
MODELS: dict[str, type[Any]] = {}
