#!/usr/bin/env python3
"""How much a picture of a .tilt sketch looks like the sketch's own thumbnail: 0 .. 100.

    look.py RENDER.png SKETCH.tilt [RENDER.png SKETCH.tilt ...]     a score a line

Needs numpy and Pillow. Both pictures are 256x256, of the same camera.

Three measures on pictures of 128 px and below, after a blur of 0.7 px, so noise and anti-aliasing do not count:
  colour  CIE Lab histogram intersection, soft bins (7 L x 7 a x 7 b), over a pyramid of 1, 4 and 16 cells
  form    SSIM of L*, Gaussian window, mean of the scales 128, 64, 32, 16 px; coarse ones weigh more
  edges   gradient orientation histograms (9 directions, cells of 8 px), sum of minima over sum of maxima
Each is rescaled so that BASE (its mean over unrelated pairs of thumbnails) is 0 and identity is 1, cut at 0.
"""
import io, struct, sys, zipfile
import numpy as np
from PIL import Image

N = 128
BASE = {"colour": 0.215, "form": 0.183, "edges": 0.239}
WEIGHT = {"colour": 0.40, "form": 0.30, "edges": 0.30}


def open_picture(path):
    """An RGB picture, N x N: a PNG, or the thumbnail of a .tilt, which is a zip with a head of 16 bytes."""
    data = open(path, "rb").read()
    if data[:4] == b"tilT":
        data = data[struct.unpack("<H", data[4:6])[0]:]
    if data[:2] == b"PK":
        data = zipfile.ZipFile(io.BytesIO(data)).read("thumbnail.png")
    picture = Image.open(io.BytesIO(data)).convert("RGB").resize((N, N), Image.BOX)
    return np.asarray(picture, dtype=np.float64) / 255


def blur(a, sigma):
    r = max(1, int(3 * sigma + 0.5))
    k = np.exp(-0.5 * (np.arange(-r, r + 1) / sigma) ** 2)
    k /= k.sum()
    for axis in (0, 1):
        pad = [(0, 0)] * a.ndim
        pad[axis] = (r, r)
        p = np.pad(a, pad, mode="edge")
        n = a.shape[axis]
        a = sum(k[i] * np.take(p, range(i, i + n), axis=axis) for i in range(2 * r + 1))
    return a


def lab(rgb):
    lin = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    m = np.array([[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]])
    xyz = lin @ m.T / np.array([0.95047, 1.0, 1.08883])
    f = np.where(xyz > 0.008856, np.cbrt(xyz), 7.787 * xyz + 16 / 116)
    return np.stack([116 * f[..., 1] - 16, 500 * (f[..., 0] - f[..., 1]), 200 * (f[..., 1] - f[..., 2])], -1)


def half(a):
    return a.reshape(a.shape[0] // 2, 2, a.shape[1] // 2, 2, *a.shape[2:]).mean((1, 3))


BINS = (7, 7, 7)
LOW = np.array([0.0, -90.0, -90.0])
STEP = np.array([100.0 / 6, 180.0 / 6, 180.0 / 6])


def soft_histogram(cells):
    """cells: (k, n, 3) Lab -> (k, bins), trilinear weights, each row sums to 1."""
    p = np.clip((cells - LOW) / STEP, 0, np.array(BINS) - 1.000001)
    i = p.astype(int)
    f = p - i
    out = np.zeros((cells.shape[0], BINS[0] * BINS[1] * BINS[2]))
    rows = np.repeat(np.arange(cells.shape[0]), cells.shape[1])
    for dl in (0, 1):
        for da in (0, 1):
            for db in (0, 1):
                d = np.array([dl, da, db])
                w = np.prod(np.where(d == 1, f, 1 - f), axis=-1)
                j = np.minimum(i + d, np.array(BINS) - 1)
                flat = (j[..., 0] * BINS[1] + j[..., 1]) * BINS[2] + j[..., 2]
                np.add.at(out, (rows, flat.ravel()), w.ravel())
    return out / cells.shape[1]


def colour(a, b):
    total, weights = 0.0, 0.0
    for level, weight in ((1, 1.0), (2, 1.0), (4, 2.0)):
        s = a.shape[0] // level
        def cells(x):
            return x.reshape(level, s, level, s, 3).transpose(0, 2, 1, 3, 4).reshape(level * level, s * s, 3)
        total += weight * np.minimum(soft_histogram(cells(a)), soft_histogram(cells(b))).sum(1).mean()
        weights += weight
    return total / weights


def ssim(a, b):
    s = 1.5
    c1, c2 = 100.0, 36.0  # steps of 10 L* in level and 6 in contrast are small
    ma, mb = blur(a, s), blur(b, s)
    va, vb, cov = blur(a * a, s) - ma * ma, blur(b * b, s) - mb * mb, blur(a * b, s) - ma * mb
    return (((2 * ma * mb + c1) * (2 * cov + c2)) / ((ma * ma + mb * mb + c1) * (va + vb + c2))).mean()


def form(a, b):
    total = 0.0
    for weight in (0.15, 0.25, 0.30, 0.30):
        total += weight * max(0.0, ssim(a, b))
        a, b = half(a), half(b)
    return total


def orientations(l, cell=8):
    gy, gx = np.gradient(l)
    strength = np.hypot(gx, gy)
    strength = strength / (strength + 2.0) * strength  # damp noise below two levels of L*
    angle = np.mod(np.arctan2(gy, gx), np.pi) * 9 / np.pi
    i = angle.astype(int) % 9
    f = angle - np.floor(angle)
    n = l.shape[0] // cell
    out = np.zeros((n, n, 9))
    y, x = np.indices(l.shape) // cell
    np.add.at(out, (y, x, i), strength * (1 - f))
    np.add.at(out, (y, x, (i + 1) % 9), strength * f)
    return blur(out, 0.6)


def edges(a, b):
    total = 0.0
    for weight in (0.5, 0.5):
        ha, hb = orientations(a), orientations(b)
        total += weight * (np.minimum(ha, hb).sum() + 1.0) / (np.maximum(ha, hb).sum() + 1.0)
        a, b = half(a), half(b)
    return total


def prepare(rgb):
    return lab(blur(rgb, 0.7))


def measure(a, b):
    """a, b: N x N x 3 Lab pictures of one field. The three raw measures, each 0 .. 1."""
    return {"colour": colour(half(a), half(b)), "form": form(a[..., 0], b[..., 0]), "edges": edges(a[..., 0], b[..., 0])}


def score(raw):
    return 100 * sum(WEIGHT[k] * max(0.0, (raw[k] - BASE[k]) / (1 - BASE[k])) for k in WEIGHT)


for render, sketch in zip(sys.argv[1::2], sys.argv[2::2]):
    raw = measure(prepare(open_picture(render)), prepare(open_picture(sketch)))
    print(f"{score(raw):.1f}  " + "  ".join(f"{k} {v:.3f}" for k, v in raw.items()))
