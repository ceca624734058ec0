#!/usr/bin/env bash
# Makes a Blender with everything that its window needs on a machine without a screen: a Debian system in a folder, with
# Blender, a virtual screen, software OpenGL and xdotool. Prints the path of its `blender`, a small program that enters
# the folder; Xvfb, xdotool and xwd lie beside it. Needs root, and a Debian or Ubuntu machine; takes about four minutes
# and 1.6 GB the first time, nothing afterwards. The packages come from where this machine takes its own.
#
#     scripts/make_blender.sh          # Blender of Debian's unstable distribution: the newest
#
# Folder: $BLENDER_ROOTS, by default blender-roots in the user's cache.
set -euo pipefail
suite=sid
roots=${BLENDER_ROOTS:-${XDG_CACHE_HOME:-$HOME/.cache}/blender-roots}
root=$roots/$suite
programs=$roots/$suite-programs
packages="ca-certificates blender xvfb libgl1-mesa-dri libgl1 libegl1 libglx-mesa0 x11-utils x11-apps xdotool
  fonts-dejavu-core python3-numpy python3-cattr python3-requests python3-zstandard"

fail() { echo "$1" >&2; exit 1; }

[ "$(id -u)" = 0 ] || fail "Making a Blender takes root: debootstrap and chroot."
command -v unshare >/dev/null || fail "Making a Blender takes unshare, of util-linux."

# Runs a command in the folder, among mounts that end with it. The folders of $SHARED (with colons between) and /tmp are
# seen there under their own names. No exec is left out, so the process that is started is the one that is meant.
mkdir -p "$programs"
cat > "$programs/enter" <<EOF
#!/usr/bin/env bash
set -euo pipefail
exec unshare --mount --propagation private bash -c '
  set -e
  root=\$1; here=\$2; shift 2
  mount --rbind /proc "\$root/proc"; mount --rbind /sys "\$root/sys"; mount --rbind /dev "\$root/dev"
  IFS=:
  for folder in /tmp \${SHARED:-}; do mkdir -p "\$root\$folder"; mount --bind "\$folder" "\$root\$folder"; done
  [ -d "\$root\$here" ] || here=/
  exec chroot "\$root" /usr/bin/env -C "\$here" PATH=/usr/local/bin:/usr/bin:/bin LANG=C.UTF-8 TERM=dumb \\
    SSL_CERT_FILE=/etc/ssl/certs/ca-certificates.crt "\$@"
' enter "$root" "\$PWD" "\$@"
EOF
chmod +x "$programs/enter"
for program in blender Xvfb xdotool xwd; do
  printf '#!/bin/sh\nexec "%s/enter" %s "$@"\n' "$programs" "$program" > "$programs/$program"
  chmod +x "$programs/$program"
done

if ! [ -x "$root/usr/bin/blender" ] || ! [ -x "$root/usr/bin/xwd" ]; then
  {
    command -v apt-get >/dev/null || fail "Making a Blender takes apt-get, which this system lacks."
    command -v debootstrap >/dev/null || { apt-get update -q && apt-get install -y -q --no-install-recommends debootstrap; }
    mirror=$(awk '/^URIs:/ {print $2; exit}' /etc/apt/sources.list.d/debian.sources 2>/dev/null || true)
    [ -n "$mirror" ] || mirror=$(awk '/^deb / {for (i = 2; i <= NF; i++) if ($i ~ /^http/) {print $i; exit}}' \
      /etc/apt/sources.list 2>/dev/null || true)
    [ -n "$mirror" ] || fail "The machine's apt sources name no mirror."
    script=/usr/share/debootstrap/scripts/$suite
    rm -rf "$root.part"  # what an interrupted attempt left
    debootstrap --variant=minbase "$suite" "$root.part" "$mirror" "$script"
    cp /etc/resolv.conf "$root.part/etc/resolv.conf"
    mkdir -p "$root.part/usr/local/share/ca-certificates"
    cp /usr/local/share/ca-certificates/*.crt "$root.part/usr/local/share/ca-certificates/" 2>/dev/null || true
    printf '#!/bin/sh\nexit 101\n' > "$root.part/usr/sbin/policy-rc.d"  # no service is started
    chmod +x "$root.part/usr/sbin/policy-rc.d"
    printf 'path-exclude /usr/share/doc/*\npath-exclude /usr/share/man/*\n' > "$root.part/etc/dpkg/dpkg.cfg.d/01nodoc"
    rm -rf "$root"
    mv "$root.part" "$root"
    # shellcheck disable=SC2086
    DEBIAN_FRONTEND=noninteractive "$programs/enter" bash -c 'apt-get update -q -o Acquire::Check-Valid-Until=false &&
      apt-get install -y -q --no-install-recommends "$@" && apt-get clean' install $packages
  } >&2
fi
echo "$programs/blender"
