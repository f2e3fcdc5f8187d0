from typing import Any

Model: Any
load: Any
check: Any
convert: Any
outputs: Any
methods: Any
