#!/bin/sh
# Measures what tile orders save: `scripts/orders.sh SCENES [PART...]` writes results/orders-*.csv, the tables of docs/results/orders.md.
# Parts: displays, all, cameras, frames, timed, axes, speed; by default all of them. docs/results/orders.md explains which cameras and displays
# were used for the design and which were held out.
set -eu
. "$(dirname "$0")/captures.sh"
here=$(dirname "$results")/scripts
shift
parts=${*:-displays all cameras frames timed axes speed}

# One line per camera: set, label, file, name of the camera.
cameras() {
    cat <<'LIST'
design crytek-atrium crytek-sponza/sponza.gltf cam_atrium_eye
design crytek-arcade crytek-sponza/sponza.gltf cam_arcade
design dabrovic-gallery dabrovic-sponza/sponza.gltf cam_gallery
design cocoa-jungle stk-cocoa-temple/stk-cocoa-temple.gltf cam_jungle
design cocoa-bridge stk-cocoa-temple/stk-cocoa-temple.gltf cam_bridge
design forest-farm stk-black-forest/stk-black-forest.gltf cam_farm
design chess-player chess-openchessset/chess_42k.gltf cam_player
held-out crytek-gallery crytek-sponza/sponza.gltf cam_gallery
held-out dabrovic-atrium dabrovic-sponza/sponza.gltf cam_atrium_eye
held-out dabrovic-arcade dabrovic-sponza/sponza.gltf cam_arcade
held-out cocoa-pond stk-cocoa-temple/stk-cocoa-temple.gltf cam_pond
held-out cocoa-temple stk-cocoa-temple/stk-cocoa-temple.gltf cam_temple
held-out forest-brook stk-black-forest/stk-black-forest.gltf cam_brook
held-out chess-low chess-openchessset/chess_42k.gltf cam_low
LIST
}

# capture FOLDER FLAGS...: captures every camera as FOLDER/SET,LABEL.textrace.
capture() {
    folder=$1
    shift
    mkdir -p "$folder"
    cameras | while read -r set label file camera; do
        "$bin/tracegen" raster "$scenes/$file" --camera "$camera" "$@" --no-plain --quiet -o "$folder/$set,$label.textrace" </dev/null 2>/dev/null
    done
}

# The built-in scenes are held-out scenes. BMW's textures fit into the caches and the teapot has none, so orders cannot change their traffic.
capture_built_in() {
    mkdir -p "$1"
    for scene in atrium jungle meadow plant car lab music-box; do
        "$bin/tracegen" raster "$scene" --no-plain --quiet -o "$1/held-out,$scene.textrace" 2>/dev/null
    done
}

# study OUTPUT TRACE... FLAGS...: writes the JSON of replay orders.
study() {
    output=$1
    shift
    "$bin/replay" orders "$@" --json --quiet >"$output" 2>/dev/null
}

write() {
    python3 "$here/orders.py" "$1" "$results"
}

fixed=z2-sta,morton,z2-lrta,gilbert+sta,zig-zag+sta,band+sta,morton+sta+offset,zig-zag+sta+offset,strip+sta+offset,adaptive+sta+offset,adaptive+sta+offset+runs,adaptive+halves+offset+runs,adaptive+lrta+offset+runs,strip+sta+infinity+runs,adaptive+sta+infinity+runs

for part in $parts; do
    case $part in
        displays)
            for display in symmetric-100 dk2 vive quest3 rift-cv1 index quest2 pimax-5k-plus; do
                size=
                [ "$display" = quest3 ] && size="--size 960x1080"
                # shellcheck disable=SC2086
                capture "$display" --hmd "$display" $size
                study "displays,$display.json" "$display"/*.textrace --orders "$fixed"
                [ "$display" = symmetric-100 ] || rm -r "$display"
            done
            capture_built_in built-in
            study displays,built-in.json built-in/*.textrace --orders "$fixed"
            write displays
            ;;
        all)
            [ -d symmetric-100 ] || capture symmetric-100 --hmd symmetric-100
            study all.json symmetric-100/*.textrace
            write all
            ;;
        cameras)
            [ -d symmetric-100 ] || capture symmetric-100 --hmd symmetric-100
            study cameras.json symmetric-100/*.textrace --orders z2-sta,zig-zag+sta+offset,adaptive+sta+offset,adaptive+sta+offset+runs,adaptive+halves+offset+runs --bounds --search greedy,greedy-64,anneal --moves 20000
            write cameras
            ;;
        frames)
            # KEEP=FOLDER keeps these traces (9 GB) for another run.
            head=${KEEP:-$work}/head
            mkdir -p "$head"
            cameras | grep -E ' (chess-player|dabrovic-gallery|crytek-atrium|crytek-gallery) ' |
                while read -r set label file camera; do
                    trace="$head/$set,$label.textrace"
                    [ -f "$trace" ] ||
                        "$bin/tracegen" raster "$scenes/$file" --camera "$camera" --path head --frames 120 --no-plain --quiet -o "$trace" </dev/null 2>/dev/null
                    study "frames,$set,$label.json" "$trace" --between keep,lose-50,flush \
                        --orders z2-sta,morton+sta+boustro,zig-zag+sta+offset+boustro,adaptive+sta+offset,adaptive+sta+offset+boustro,adaptive+sta+offset+boustro+runs,adaptive+halves+offset+boustro+runs,band+sta+offset+boustro
                    study "learn,$set,$label.json" "$trace" --orders z2-sta --learn
                    [ -n "${KEEP:-}" ] || rm "$trace"
                done
            write frames
            ;;
        timed)
            [ -d symmetric-100 ] || capture symmetric-100 --hmd symmetric-100
            for cores in 2 4 8 16; do
                study "timed,$cores.json" symmetric-100/*.textrace --mode timed --dram lpddr4 --cores "$cores" --caches 8/128,16/256 \
                    --orders z2-sta,morton,z2-lrta,zig-zag+sta+offset,adaptive+sta+offset,adaptive+sta+offset+static,adaptive+sta+offset+affinity,adaptive+sta+offset+quads,adaptive+sta+offset+runs,adaptive+halves+offset+runs,adaptive+lrta+offset+runs
            done
            write timed
            ;;
        axes)
            [ -d symmetric-100 ] || capture symmetric-100 --hmd symmetric-100
            orders=z2-sta,zig-zag+sta+offset+runs,adaptive+sta+offset+runs,adaptive+halves+offset+runs,adaptive+lrta+offset+runs,band4+sta+offset+runs,band8+sta+offset+runs
            axis() {
                name=$1
                shift
                study "axes,$name.json" "$@" --orders $orders
            }
            axis "BC1, 16-byte lines" symmetric-100/*.textrace
            axis "32-byte lines" symmetric-100/*.textrace --line 32
            axis "64-byte lines" symmetric-100/*.textrace --line 64
            axis "BC7" symmetric-100/*.textrace --texel-format bc7
            axis "ASTC 6x6" symmetric-100/*.textrace --texel-format astc-6x6
            axis "RGBA8" symmetric-100/*.textrace --texel-format rgba8
            axis "tiles of 32 px" symmetric-100/*.textrace --tile-px 32
            axis "one core" symmetric-100/*.textrace --cores 1
            axis "8 cores" symmetric-100/*.textrace --cores 8
            axis "512 KiB L2" symmetric-100/*.textrace --caches 8/512
            capture shadows --hmd symmetric-100 --shadows
            axis "four shadow cascades" shadows/*.textrace
            axis "linear shadow maps" shadows/*.textrace --shadow-map-order linear
            rm -r shadows
            capture whole --hmd symmetric-100 --geometry
            axis "whole frame, all clients" whole/*.textrace --frame tile-based
            rm -r whole
            write axes
            ;;
        speed)
            [ -d symmetric-100 ] || capture symmetric-100 --hmd symmetric-100
            python3 "$here/orders.py" speed "$results" "$bin/replay" symmetric-100/*.textrace
            ;;
        *)
            echo "expected displays, all, cameras, frames, timed, axes or speed, found $part" >&2
            exit 2
            ;;
    esac
done
