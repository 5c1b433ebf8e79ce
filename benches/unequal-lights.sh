#!/usr/bin/env bash
# Rays to a noise of half an 8-bit level: many lights of which a few are strong, and many spot lights. The numbers of
# rays do not depend on the load of the machine.
#
#     cargo build --release
#     benches/unequal-lights.sh > benches/runs/DATE-unequal-lights.txt
#
# ZERKALO names a program that has been built already.
set -euo pipefail
cd "$(dirname "$0")/.."
zerkalo="${ZERKALO:-target/release/zerkalo}"
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT

# Prints a scene with $1 lights, of which $2 have the intensity 0.7 / $2 and the others $3. With a fourth argument the
# lights are spots with this outer angle in degrees. The intensity of strong spots is divided by the solid angle of
# their cone in hemispheres.
scene() {
    cat <<'TOML'
[film]
size = [160, 120]
[camera]
eye = [0.0, 3.0, 7.0]
target = [0.0, 0.5, 0.0]
view_angle.vertical = 40.0
[ambient]
color = [0.1, 0.1, 0.1]
[materials.white]
color = [0.8, 0.8, 0.8]
[[object]]
material = "white"
shape.platform = { center = [0.0, 0.0, 0.0], size = [10.0, 10.0] }
[[object]]
material = "white"
shape.sphere = { center = [0.0, 0.5, 0.0], radius = 0.5 }
[[object]]
material = "white"
shape.box = { center = [1.5, 0.5, 0.3], size = [0.6, 1.0, 0.6] }
TOML
    awk -v n="$1" -v strong="$2" -v weak="$3" -v angle="${4:-0}" '
        function fraction(x) { return x - int(x) }
        function between(low, high, x) { return low + (high - low) * fraction(x) }
        BEGIN {
            total = angle == 0 ? 0.7 : 0.7 / (1 - cos(angle * 3.14159265359 / 180))
            for (i = 0; i < n; i++) {
                # Additive recurrence with irrational steps, the first light in front at the right.
                x = between(-4, 4, 0.75 + i * 0.7548776662)
                y = between(2, 4, 0.95 + i * 0.3819660113)
                z = between(-4, 4, 0.875 + i * 0.5698402910)
                position = sprintf("position = [%.4f, %.4f, %.4f]", x, y, z)
                printf "[[light]]\n"
                if (angle == 0) printf "point = { %s }\n", position
                else printf "spot = { %s, direction = [%.4f, -1.0, %.4f], inner_angle = %.1f, outer_angle = %.1f }\n",
                    position, between(-0.5, 0.5, i * 0.6180339887), between(-0.5, 0.5, i * 0.4142135624), 0.7 * angle, angle
                printf "falloff = \"none\"\nintensity = %.9f\n", i < strong ? total / strong : weak
            }
        }'
}

# Renders the scene with the given arguments. Prints them with the number of samples per pixel and millions of rays.
run() {
    scene "$@" > "$work/scene.toml"
    "$zerkalo" render "$work/scene.toml" -o "$work/scene.png" --noise 0.5 --stats "$work/stats.json" > /dev/null 2>&1
    awk -v lights="$1" -v strong="$2" -v weak="$3" -v angle="${4:-point}" -F '[:,]' '
        /"spp_mean"/ { spp = $2 }
        /"rays"/ { rays = $2 }
        END { printf "%6d  %6d  %9s  %6s  %13.1f  %13.2f\n", lights, strong, weak, angle, spp, rays / 1e6 }
    ' "$work/stats.json"
}

echo "zerkalo $("$zerkalo" --version | cut -d' ' -f2)"
printf '%6s  %6s  %9s  %6s  %13s  %13s\n' lights strong weak angle samples/pixel "million rays"
run 1 1 0
for weak in 0.000001 0.01; do
    for n in 15 16 64 1000; do run "$n" 1 "$weak"; done
done
for strong in 2 4 8 12 64; do run 64 "$strong" 0.001; done
for angle in 30 60; do
    for n in 15 16 64 512; do run "$n" "$n" 0 "$angle"; done
done
