#!/usr/bin/env python3
"""Makes the files in the folders beside this script with programs independent of this crate.

Needs NumPy, nibabel, pynrrd, VTK and mrcfile from PyPI. Run it in this folder. All volumes have
7 x 5 x 6 voxels whose values follow from their place: n = x + 7 y + 35 z for unsigned integers,
n - 100 for signed integers, n / 2 - 3 for floats.
"""

import gzip
import pathlib

import mrcfile
import nibabel
import nrrd
import numpy as np
import vtk
from vtk.util.numpy_support import numpy_to_vtk

NX, NY, NZ = 7, 5, 6
SPACING = (0.5, 1.25, 2.0)
ORIGIN = (-10.0, 20.5, 3.0)
TYPES = ["uint8", "int8", "uint16", "int16", "uint32", "int32", "uint64", "int64",
         "float16", "float32", "float64"]


def zyx(dtype):
    """The volume as array[z, y, x]."""
    n = np.arange(NX * NY * NZ).reshape(NZ, NY, NX)
    kind = np.dtype(dtype).kind
    return {"u": n, "i": n - 100, "f": n / 2 - 3}[kind].astype(dtype)


def xyz(dtype):
    """The volume as array[x, y, z], contiguous in x."""
    return zyx(dtype).transpose(2, 1, 0)


def folder(name):
    path = pathlib.Path(name)
    path.mkdir(exist_ok=True)
    return path


def raw_files():
    at = folder("raw")
    size = f"{NX}x{NY}x{NZ}"
    for name in TYPES:
        zyx(name).tofile(at / f"ramp_{size}_{name}.raw")
    zyx("int16").astype(">i2").tofile(at / "big_endian.dat")
    with gzip.GzipFile(at / f"zipped_{size}_uint16.raw.gz", "wb", mtime=0) as file:
        file.write(zyx("uint16").tobytes())


def npy_files():
    at = folder("npy")
    for name in TYPES:
        np.save(at / f"{name}.npy", zyx(name))
    np.save(at / "big_endian.npy", zyx("float32").astype(">f4"))
    np.save(at / "fortran.npy", np.asfortranarray(zyx("int16")))
    np.save(at / "slice.npy", zyx("float32")[2])
    np.save(at / "slice_fortran.npy", np.asfortranarray(zyx("float32")[2]))
    np.save(at / "series.npy", np.stack([zyx("int16"), zyx("int16") + 1000]))
    np.save(at / "bool.npy", zyx("uint8") % 2 == 1)
    np.save(at / "complex.npy", zyx("float32").astype("complex64"))
    np.save(at / "record.npy", np.zeros((2, 2, 2), [("a", "<f4"), ("b", "<i2")]))
    nan = zyx("float32")
    nan[4, 3, 2] = np.nan
    np.save(at / "nan.npy", nan)
    for version in [(2, 0), (3, 0)]:
        with open(at / f"version_{version[0]}.npy", "wb") as file:
            np.lib.format.write_array(file, zyx("uint16"), version)
    with gzip.GzipFile(at / "zipped.npy.gz", "wb", mtime=0) as file:
        np.save(file, zyx("uint8"))


def nrrd_files():
    at = folder("nrrd")
    space = {"space dimension": 3, "space directions": np.diag(SPACING),
             "space origin": ORIGIN}
    for name in TYPES:
        if name != "float16":
            nrrd.write(str(at / f"{name}.nrrd"), xyz(name), {**space, "encoding": "raw"})
    nrrd.write(str(at / "gzip.nrrd"), xyz("int16"), {**space, "encoding": "gzip"})
    nrrd.write(str(at / "big_endian.nrrd"), xyz("float64").astype(">f8"),
               {**space, "encoding": "raw", "endian": "big"})
    nrrd.write(str(at / "spacings.nrrd"), xyz("uint8"),
               {"spacings": list(SPACING), "encoding": "raw"})
    nrrd.write(str(at / "slice.nrrd"), xyz("float32")[:, :, 2], {"encoding": "raw"})
    turned = np.diag(SPACING)[[1, 0, 2]]
    nrrd.write(str(at / "turned.nrrd"), xyz("uint8"),
               {**space, "space directions": turned, "encoding": "raw"})
    nrrd.write(str(at / "vectors.nrrd"), np.zeros((3, 2, 2, 2), np.float32),
               {"kinds": ["vector", "domain", "domain", "domain"], "encoding": "raw"})
    nrrd.write(str(at / "text.nrrd"), xyz("uint8"), {**space, "encoding": "ascii"})
    for name in ["raw", "gzip"]:
        ending = {"raw": "raw", "gzip": "raw.gz"}[name]
        nrrd.write(str(at / f"detached_{name}.nhdr"), xyz("uint16"), {**space, "encoding": name},
                   detached_header=True)
        assert (at / f"detached_{name}.{ending}").exists()
    for file in [*at.glob("*.nhdr"), *at.glob("*.nrrd")]:  # pynrrd notes the time in a comment
        lines = file.read_bytes().split(b"\n")
        file.write_bytes(b"\n".join(line for line in lines if not line.startswith(b"# on ")))


def image(dtype, cells=False, name="density"):
    grid = vtk.vtkImageData()
    # Extents need not begin at 0: the first voxel lies at the origin plus this many spacings.
    start = (2, 0, -1)
    shift = 0.5 if cells else 0.0
    grid.SetExtent(*[v for n, s in zip((NX, NY, NZ), start) for v in (s, s + n - (not cells))])
    grid.SetSpacing(*SPACING)
    grid.SetOrigin(*[o - (s + shift) * d for o, s, d in zip(ORIGIN, start, SPACING)])
    if name:
        array = numpy_to_vtk(zyx(dtype).ravel(), deep=True)
        array.SetName(name)
        (grid.GetCellData() if cells else grid.GetPointData()).SetScalars(array)
    return grid


def write_vti(path, grid, mode="Appended", encode=False, zlib=False, wide=False, big=False):
    writer = vtk.vtkXMLImageDataWriter()
    writer.SetFileName(str(path))
    writer.SetInputData(grid)
    getattr(writer, f"SetDataModeTo{mode}")()
    writer.SetEncodeAppendedData(encode)
    (writer.SetCompressorTypeToZLib if zlib else writer.SetCompressorTypeToNone)()
    (writer.SetHeaderTypeToUInt64 if wide else writer.SetHeaderTypeToUInt32)()
    (writer.SetByteOrderToBigEndian if big else writer.SetByteOrderToLittleEndian)()
    writer.SetBlockSize(256)  # several blocks, of which the last is not full
    assert writer.Write() == 1


def vti_files():
    at = folder("vti")
    for name in TYPES:
        if name != "float16":
            write_vti(at / f"{name}.vti", image(name))
    for mode, encode in [("Appended", False), ("Appended", True), ("Binary", False)]:
        for zlib in [False, True]:
            for wide in [False, True]:
                parts = [mode.lower(), "base64" * encode, "zlib" * zlib, "64" if wide else "32"]
                name = "_".join(part for part in parts if part)
                write_vti(at / f"{name}.vti", image("float32"), mode, encode, zlib, wide)
    write_vti(at / "big_endian.vti", image("int16"), zlib=True, wide=True, big=True)
    for name in ["int8", "uint8", "float64", "int64"]:
        write_vti(at / f"ascii_{name}.vti", image(name), "Ascii")
    for mode in ["Appended", "Binary"]:
        write_vti(at / f"cells_{mode.lower()}.vti", image("uint16", cells=True), mode)
    several = image("float32")
    for name, array in [("first", zyx("uint8")), ("last", zyx("int16"))]:
        data = numpy_to_vtk(array.ravel(), deep=True)
        data.SetName(name)
        several.GetPointData().AddArray(data)
    vectors = numpy_to_vtk(np.zeros((NX * NY * NZ, 3), np.float32), deep=True)
    vectors.SetName("vectors")
    several.GetPointData().SetVectors(vectors)
    other = numpy_to_vtk(np.arange(3.0), deep=True)
    other.SetName("other")
    several.GetFieldData().AddArray(other)
    write_vti(at / "several.vti", several)
    write_vti(at / "several_inline.vti", several, "Binary")
    write_vti(at / "nothing.vti", image("float32", name=None))
    turned = image("uint8")
    turned.SetDirectionMatrix(0, 1, 0, 1, 0, 0, 0, 0, 1)
    write_vti(at / "turned.vti", turned)


def mrc_files():
    at = folder("mrc")

    def write(name, array, edit=None):
        with mrcfile.new(at / f"{name}.mrc", overwrite=True) as file:
            file.set_data(array)
            file.voxel_size = SPACING
            file.header.origin = ORIGIN
            file.header.label[0] = ""  # holds the time
            if edit:
                edit(file)

    for name in ["int8", "int16", "uint16", "float16", "float32"]:
        write(name, zyx(name))
    write("big_endian", zyx("int16").astype(">i2"))
    write("extended", zyx("float32"),
          lambda file: file.set_extended_header(np.zeros(40, "V2")))

    def start(file):
        file.header.origin = (0, 0, 0)
        file.header.nxstart, file.header.nystart, file.header.nzstart = -4, 2, 10

    write("start", zyx("float32"), start)

    def order(mapc, mapr, maps):
        def edit(file):
            file.header.mapc, file.header.mapr, file.header.maps = mapc, mapr, maps
            file.header.mx, file.header.my, file.header.mz = NX, NY, NZ
            file.header.cella = tuple(n * d for n, d in zip((NX, NY, NZ), SPACING))
        return edit

    # Files whose columns, rows and sections run along other axes hold the array transposed.
    write("order_213", zyx("int16").transpose(0, 2, 1).copy(), order(2, 1, 3))
    write("order_312", zyx("int16").transpose(1, 2, 0).copy(), order(3, 1, 2))
    write("complex", zyx("float32").astype("complex64"))

    def stack(file):
        file.set_volume()

    write("stack", np.stack([zyx("int16"), zyx("int16") + 1000]))
    with gzip.GzipFile(at / "zipped.mrc.gz", "wb", mtime=0) as file:
        file.write((at / "int16.mrc").read_bytes())


def pair_files():
    at = folder("pair")
    affine = np.diag([*SPACING, 1.0])
    affine[:3, 3] = ORIGIN
    nibabel.save(nibabel.Nifti1Pair(xyz("int16"), affine), at / "plain.img")
    nibabel.save(nibabel.Nifti1Pair(xyz("float32"), affine), at / "zipped.img.gz")


if __name__ == "__main__":
    raw_files()
    npy_files()
    nrrd_files()
    vti_files()
    mrc_files()
    pair_files()
