#!/usr/bin/env bash
# Makes target/zerkalo-VERSION-x86_64-v3.tar.gz: a static program for any Linux on x86 processors since about 2013, with
# the documentation, the scenes and the licences of all crates. `docs/package.sh`, from the root of the repository.
set -euo pipefail
target=x86_64-unknown-linux-gnu
folder=${CARGO_TARGET_DIR:-target}
RUSTFLAGS="-C target-cpu=x86-64-v3 -C target-feature=+crt-static" cargo build --release --locked --target "$target"
name="zerkalo-$(cargo pkgid | sed 's/.*[#@]//')-x86_64-v3"
rm -rf "${folder:?}/$name"
mkdir "$folder/$name"
cp -r "$folder/$target/release/zerkalo" README.md CHANGELOG.md LICENSE-* docs scenes "$folder/$name"
docs/licences.sh > "$folder/$name/LICENCES.txt"
tar -C "$folder" -czf "$folder/$name.tar.gz" "$name"
echo "$folder/$name.tar.gz"
