#!/usr/bin/env bash
# Makes canter_VERSION_ARCH.deb in a folder (target/packages unless named) from the release build:
#
#     cargo build --release --locked --bin canter
#     cargo build --release --locked --package canter-fleet
#     packaging/deb.sh [FOLDER]
#
# CANTER and CANTER_FLEET name other binaries to pack. It needs dpkg-deb and binutils. The same binaries and
# the same commit give the same bytes: times are those of the commit, owner is root, the order is fixed. COMPRESSION
# is that of dpkg-deb, xz unless named.
set -euo pipefail
cd "$(dirname "$0")/.."

binary=${CANTER:-target/release/canter}
fleet=${CANTER_FLEET:-target/release/canter-fleet}
out=${1:-target/packages}
needs() { [ -x "$1" ] || { echo "packaging/deb.sh: there is no $1: cargo build --release --locked $2" >&2; exit 1; }; }
needs "$binary" "--bin canter"
needs "$fleet" "--package canter-fleet"
version=$("$binary" --version | awk '{print $2}')
architecture=$(dpkg --print-architecture)
SOURCE_DATE_EPOCH=${SOURCE_DATE_EPOCH:-$(git log -1 --format=%ct 2>/dev/null || echo 0)}
export SOURCE_DATE_EPOCH

tree=$(mktemp -d)
trap 'rm -rf "$tree"' EXIT
put() { install -D -m "$1" "$2" "$tree/$3"; }

mkdir -p "$tree"/usr/share/{bash-completion/completions,zsh/vendor-completions,fish/vendor_completions.d}
# A program with its manual pages and completions, which it writes itself.
program() {
    put 755 "$1" "usr/bin/$2"
    strip "$tree/usr/bin/$2"
    "$1" man --folder "$tree/usr/share/man/man1"
    "$1" completions bash > "$tree/usr/share/bash-completion/completions/$2"
    "$1" completions zsh > "$tree/usr/share/zsh/vendor-completions/_$2"
    "$1" completions fish > "$tree/usr/share/fish/vendor_completions.d/$2.fish"
}
program "$binary" canter
program "$fleet" canter-fleet
find "$tree/usr/share/man" -name '*.1' -exec gzip -9n {} +
put 644 packaging/limits.conf etc/security/limits.d/canter.conf
put 644 packaging/arm.conf usr/share/doc/canter/examples/cell-arm.conf
for unit in packaging/systemd/*.service; do put 644 "$unit" "usr/lib/systemd/system/${unit##*/}"; done
put 644 packaging/systemd/sysusers.conf usr/lib/sysusers.d/canter.conf
put 644 packaging/copyright usr/share/doc/canter/copyright
for example in examples/*.canon; do put 644 "$example" "usr/share/doc/canter/$example"; done

mkdir "$tree/DEBIAN"
echo /etc/security/limits.d/canter.conf > "$tree/DEBIAN/conffiles"
put 755 packaging/postinst DEBIAN/postinst
put 755 packaging/prerm DEBIAN/prerm
put 755 packaging/postrm DEBIAN/postrm
size=$(du -k -s --apparent-size "$tree/usr" | cut -f1)
# The newest symbols that the binaries use; a system with an older library refuses the package.
libc=$(objdump -T "$tree"/usr/bin/* | grep -o 'GLIBC_[0-9.]*' | cut -d_ -f2 | sort -uV | tail -n1)
cat > "$tree/DEBIAN/control" <<CONTROL
Package: canter
Version: $version
Architecture: $architecture
Maintainer: Canter <canter@localhost>
Installed-Size: $size
Depends: libc6 (>= $libc), libgcc-s1
Section: electronics
Priority: optional
Description: real-time execution of motions of robot arms
 Canter executes programs in NIST's canonical robot command language on a
 robot arm, at servo rate: it plans each motion within the limits of joints and
 tool, proves them, and sends the setpoints to a driver process. canter-fleet
 shows and commands the arms of many cells over an encrypted network.
CONTROL
(cd "$tree" && find usr etc -type f -print0 | LC_ALL=C sort -z | xargs -0 md5sum > DEBIAN/md5sums)
find "$tree" -exec touch -h -d "@$SOURCE_DATE_EPOCH" {} +
chmod -R u=rwX,go=rX "$tree"
mkdir -p "$out"
package="$out/canter_${version}_$architecture.deb"
dpkg-deb --root-owner-group -Z"${COMPRESSION:-xz}" --build "$tree" "$package" >/dev/null
echo "$package"
