#!/usr/bin/env bash
# The Python package's tests with a wheel for aarch64, on an emulated processor: Debian's Python for aarch64 is unpacked into
# a folder, and the wheels of what the tests need beside it. `python/build_wheels.sh aarch64-unknown-linux-gnu` builds the
# wheel. Not part of `.ci/run`: building takes a quarter of an hour, and the tests two minutes.
#
#     .ci/aarch64-wheel.sh python/dist/WHEEL.whl [ARGUMENTS OF pytest]
set -euo pipefail
wheel=$(realpath "${1:?name the wheel, python/dist/WHEEL.whl}")
shift
tests=$(realpath "$(dirname "$0")/../python/tests")
if ! command -v qemu-aarch64 > /dev/null; then
    apt-get update -q
    DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends qemu-user
fi
dpkg --print-foreign-architectures | grep -qx arm64 || { dpkg --add-architecture arm64; apt-get update -q; }
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"

# The version of Debian's `python3`, whatever Python is installed here.
version=$(apt-cache show python3:arm64 | sed -n 's/^Version: \([0-9]*\.[0-9]*\).*/\1/p' | head -n 1)
mkdir packages wheels
(cd packages && apt-get download -q {python"$version",python"$version"-minimal,libpython"$version"-minimal,libpython"$version"-stdlib}:arm64 \
    {libc6,libgcc-s1,libstdc++6,zlib1g,libexpat1,libffi8,libssl3,libbz2-1.0,liblzma5,libuuid1,libcrypt1}:arm64)
for package in packages/*.deb; do dpkg -x "$package" root; done

python3 -m pip download --quiet --only-binary=:all: --python-version "$version" --dest wheels \
    --platform manylinux_2_28_aarch64 --platform manylinux_2_27_aarch64 --platform manylinux2014_aarch64 numpy pytest 'gymnasium>=1.1'
for file in wheels/*.whl "$wheel"; do python3 -m zipfile -e "$file" site; done

# Tests start more processes of the same Python.
cat > python << END
#!/bin/sh
export PYTHONHOME=$folder/root/usr PYTHONPATH=$folder/site
exec qemu-aarch64 -L $folder/root -0 "\$0" $folder/root/usr/bin/python$version "\$@"
END
chmod +x python
./python -m pytest -q -p no:cacheprovider "$tests" "$@"
