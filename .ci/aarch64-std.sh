# Sourced by what compiles for aarch64 Linux: sets RUSTC to Debian's compiler, whose standard library for aarch64 is a
# package, and installs both where they are missing. Rustup's `rustup target add` does the same where it can be reached.
if ! /usr/bin/rustc --version > /dev/null 2>&1; then
    dpkg --add-architecture arm64
    apt-get update -q
    DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends rustc-web
fi
if [ ! -d "$(/usr/bin/rustc --print sysroot)/lib/rustlib/aarch64-unknown-linux-gnu" ]; then
    dpkg --print-foreign-architectures | grep -qx arm64 || { dpkg --add-architecture arm64; apt-get update -q; }
    # The package would need the rest of an aarch64 system; its files do not.
    packages=$(mktemp -d)
    (cd "$packages" && apt-get download -q libstd-rust-web-dev:arm64 && dpkg -x ./*.deb .)
    cp -r "$packages/usr/lib/rustlib/aarch64-unknown-linux-gnu" "$(/usr/bin/rustc --print sysroot)/lib/rustlib/"
    rm -r "$packages"
fi
export RUSTC=/usr/bin/rustc
