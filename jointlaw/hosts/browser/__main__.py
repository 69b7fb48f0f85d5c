"""`python -m jointlaw.hosts.browser` makes joint.wasm anew, after a change of the law's C files."""

from .export import HERE, WASM, compiled

(HERE / WASM).write_bytes(compiled())
