#!/bin/sh
# Makes the reference streams in this folder with the `zfp` program (written with version 1.0.0):
# NAME.zfp holds the stream, NAME.out the f32 samples that `zfp` decodes from it.
# Samples come from integer arithmetic only, so that every machine makes the same files.
set -eu
cd "$(dirname "$0")"

samples() { # kind nx ny nz
    python3 - "$@" <<'PY'
import struct, sys
kind, nx, ny, nz = sys.argv[1], *map(int, sys.argv[2:])
state = 12345
def random():
    global state
    state = (state * 1103515245 + 12345) % 2**31
    return state
for z in range(nz):
    for y in range(ny):
        for x in range(nx):
            if kind == "smooth":
                value = (x * x - 3 * y * z + 7 * x * z - y * y) / 64.0
            elif kind == "noise":
                value = random() / 2.0**20 - 1024.0
            elif kind == "mixed":
                # Zero blocks, spikes, negative zeros and wide exponent ranges side by side.
                pick = (x // 4 + 2 * (y // 4) + 3 * (z // 4)) % 4
                scale = 2.0 ** (random() // 64 % 60 - 30)
                value = [0.0, scale, -0.0 if random() // 64 % 2 else 1e30, -scale * x][pick]
            sys.stdout.buffer.write(struct.pack("<f", value))
PY
}

make() { # name kind nx ny nz rate header(-h or empty)
    samples "$2" "$3" "$4" "$5" > "$1.raw"
    # shellcheck disable=SC2086 # an empty header option must vanish
    zfp -q $7 -f -3 "$3" "$4" "$5" -r "$6" -i "$1.raw" -z "$1.zfp" -o "$1.out"
}

make smooth_r1 smooth 13 9 6 1 ""
make smooth_r16_header smooth 13 9 6 16 -h
make noise_r2.3 noise 10 11 7 2.3 ""
make noise_r7.7_header noise 10 11 7 7.7 -h
make noise_r33_header noise 10 11 7 33.125 -h
make mixed_r0.2_header mixed 14 13 12 0.2 -h
make mixed_r4.7 mixed 14 13 12 4.7 ""
make mixed_r20_header mixed 14 13 12 20 -h
# The original samples are not needed: streams are compared by what they decode to.
rm ./*.raw
