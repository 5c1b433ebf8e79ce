#!/usr/bin/env bash
# Renders the contact sheet of the gallery: a scene of rectangles, each with one picture as its texture.
# `docs/gallery.sh [ZERKALO]`, from the root of the repository.
set -euo pipefail
scene=docs/images/contact-sheet.toml i=0
trap 'rm "$scene"' EXIT
{
    echo '# Contact sheet of the gallery.'
    echo 'film.size = [1280, 292]'
    echo 'camera = { eye = [0.0, 0.0, 10.0], target = [0.0, 0.0, 0.0], view_angle.horizontal = 35.0 }'
    echo 'ambient.color = [1.0, 1.0, 1.0]'
    for picture in docs/images/gallery-*.png; do
        at=$(awk "BEGIN { print ($i % 5 - 2) * 1.26 \", \" (0.5 - int($i / 5)) * 0.714 }")
        echo "[materials.m$i]"
        echo 'color = [1.0, 1.0, 1.0]'
        echo "texture.image = { file = \"${picture##*/}\", mapping = \"uv\" }"
        echo '[[object]]'
        echo "material = \"m$i\""
        echo "shape.rectangle = { center = [$at, 0.0], size = [1.24, 0.6975], normal = [0.0, 0.0, 1.0] }"
        i=$((i + 1))
    done
} > "$scene"
"${1:-target/release/zerkalo}" render -q "$scene" -o docs/images/contact-sheet.png --spp 256 --noise 0.3
