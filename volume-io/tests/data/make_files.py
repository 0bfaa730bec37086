#!/usr/bin/env python3
"""Makes the files of this folder with programs independent of this crate.

Needs the `zfp` program (1.0 or later) on the path, NumPy and nibabel. Run it in this folder.
Every `NAME.zfp` comes with `NAME.raw`: what the `zfp` program itself decodes from it,
little-endian, x fastest.
"""

import subprocess

import nibabel
import numpy as np

DIMS = (9, 7, 6)  # x, y, z


def field(dims, dtype, scale=1.0):
    rng = np.random.default_rng(20)
    axes = np.meshgrid(*[np.arange(n) for n in dims], indexing="ij")
    smooth = sum(np.sin(0.4 * a + i) for i, a in enumerate(axes))
    values = scale * (smooth + 0.05 * rng.standard_normal(dims))
    return values.astype(dtype)


def zfp(name, values, *mode, header=True):
    letter = {"float32": "f32", "float64": "f64", "int32": "i32", "int64": "i64"}[str(values.dtype)]
    shape = [str(n) for n in values.shape]
    layout = ["-t", letter, f"-{len(shape)}", *shape]
    head = ["-h"] if header else []
    values.flatten(order="F").tofile("input.tmp")
    run = lambda *args: subprocess.run(["zfp", "-q", *args], check=True)
    run(*head, "-i", "input.tmp", *layout, *mode, "-z", f"{name}.zfp")
    if header:
        run("-h", "-z", f"{name}.zfp", "-o", f"{name}.raw")
    else:
        run("-z", f"{name}.zfp", *layout, *mode, "-o", f"{name}.raw")
    subprocess.run(["rm", "input.tmp"], check=True)


def zfp_files():
    f32 = field(DIMS, np.float32)
    zfp("rate_4", f32, "-r", "4")
    zfp("rate_4_3", f32, "-r", "4.3")
    zfp("rate_0_15", f32, "-r", "0.15")
    zfp("rate_34_5", f32, "-r", "34.5")  # more than 2048 bits per block: header of 148 bits
    zfp("headerless_4_3", f32, "-r", "4.3", header=False)
    zfp("precision", f32, "-p", "14")
    zfp("accuracy", f32, "-a", "1e-3")
    zfp("reversible", f32, "-R")
    zfp("expert", f32, "-c", "30", "700", "20", "-12")
    zfp("f64_rate", field(DIMS, np.float64), "-r", "11")
    zfp("f64_reversible", field(DIMS, np.float64), "-R")
    zfp("i32_reversible", field(DIMS, np.int32, 1000.0), "-R")
    zfp("i64_precision", field(DIMS, np.int64, 1.0e9), "-p", "40")
    zfp("rank_1", field((37,), np.float32), "-r", "12")
    zfp("rank_2", field((13, 10), np.float32), "-a", "1e-4")
    zfp("rank_4", field((5, 4, 3, 2), np.float32), "-r", "8")


def nifti(name, values, affine, little=True):
    header = nibabel.Nifti1Header(endianness="<" if little else ">")
    header.set_data_dtype(values.dtype)
    nibabel.save(nibabel.Nifti1Image(values, affine, header), name)


def nifti_files():
    affine = np.diag([0.7, 1.0, 2.5, 1.0])
    affine[:3, 3] = [-10.0, 20.5, 3.0]
    types = ["uint8", "int8", "uint16", "int16", "uint32", "int32", "uint64", "int64",
             "float32", "float64"]
    for name in types:
        values = np.arange(np.prod(DIMS)).reshape(DIMS, order="F") % 120
        if not name.startswith("u"):
            values = values - 60
        nifti(f"{name}.nii", values.astype(name), affine)
    big = (np.arange(np.prod(DIMS)).reshape(DIMS, order="F") * 50 - 9000).astype(">i2")
    nifti("big_endian.nii.gz", big, affine, little=False)
    mirrored = affine.copy()
    mirrored[0, 0] *= -1
    nifti("mirrored.nii.gz", big.astype("<i2"), mirrored)
    series = np.stack([np.full(DIMS, t, np.int16) for t in (5, 6, 7)], axis=-1)
    nifti("series.nii.gz", series, affine)
    # nibabel stores floats as scaled integers where the header asks for integers.
    scaled = nibabel.Nifti1Image(field(DIMS, np.float64, 3.0), affine)
    scaled.set_data_dtype(np.int16)
    nibabel.save(scaled, "scaled.nii.gz")
    decoded = nibabel.load("scaled.nii.gz").get_fdata()
    decoded.astype("<f8").flatten(order="F").tofile("scaled.raw")


if __name__ == "__main__":
    zfp_files()
    nifti_files()
