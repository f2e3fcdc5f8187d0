#!/usr/bin/env bash
# The `RUSTC_WRAPPER` of `.ci/python.sh`: compiles the crate `_native` with Clippy, and all others as they are without it.
case " $* " in
    *" --crate-name _native "*) exec clippy-driver "$@" ;;
    *) exec "$@" ;;
esac
