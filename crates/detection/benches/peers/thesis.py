#!/usr/bin/env python3
"""The thesis's scores as one would write them with numpy, vectorised over frames and features.

Reads bodies.f64, (bodies, frames, features, 3), and shape.f64, these three sizes, from the folder given, or an archive
with `points` and `body_ids`; see ratios/peer.rs. Answers with the confidences rigid, prismatic and revolute of the last
pair. A request is the number of pairs to judge: neighbours, (0, 1), (1, 2) and so on; and, if it has a second number, how
often the first pair is judged before time is taken.
"""
import sys
import time
from pathlib import Path

import numpy as np
from scipy.spatial.distance import pdist
from scipy.special import erfc


def q_function(x, mean, steepness):
    return 0.5 * erfc((x - mean) * steepness / np.sqrt(2))


def register(shape, frames):
    """Rotations and translations from a shape (F, 3) to frames (T, F, 3)."""
    centre = shape.mean(0)
    u, _, vt = np.linalg.svd((shape - centre).T @ frames)
    v, ut = vt.swapaxes(1, 2), u.swapaxes(1, 2)
    sign = np.ones((len(frames), 3))
    sign[:, 2] = np.sign(np.linalg.det(v @ ut))
    rotation = (v * sign[:, None]) @ ut
    return rotation, frames.mean(1) - rotation @ centre


def prismatic(local):
    frames, features, _ = local.shape
    lengths = np.array([pdist(local[:, f]).max() for f in range(features)])
    longest = lengths.argmax()
    start = local[0, longest]
    end = local[np.linalg.norm(local[:, longest] - start, axis=1).argmax(), longest]
    aligned = local - local[0] + start
    direction = end - start
    length = np.linalg.norm(direction)
    along = (aligned - start) @ direction / length**2
    off = np.linalg.norm(np.cross(aligned - start, direction), axis=2) / length
    section = np.clip((along * 10).astype(int), 0, 9).ravel()
    inside = (off < 0.1 * length).ravel()
    total = np.bincount(section, minlength=10)
    count = np.bincount(section, weights=inside, minlength=10)
    cylinder = (count[total > 0] / total[total > 0]).min()
    return cylinder * (1 - q_function((lengths / lengths.max()).mean(), 0.93, 40.0))


def taubin(x, y):
    """Chernov's form of Taubin's fit, Newton's iteration over all features at once; centroids are the origin."""
    z = x * x + y * y
    xx, yy, xy = (x * x).mean(1), (y * y).mean(1), (x * y).mean(1)
    xz, yz, zz = (x * z).mean(1), (y * z).mean(1), (z * z).mean(1)
    mean = xx + yy
    c = xx * yy - xy**2
    variance = zz - mean * mean
    a3, a2 = 4 * mean, -3 * mean * mean - zz
    a1 = variance * mean + 4 * c * mean - xz**2 - yz**2
    a0 = xz * (xz * yy - yz * xy) + yz * (yz * xx - xz * xy) - variance * c
    root = np.zeros(len(x))
    for _ in range(20):
        root = root - (a0 + root * (a1 + root * (a2 + root * a3))) / (a1 + root * (2 * a2 + root * 3 * a3))
    determinant = 2 * (root * root - root * mean + c)
    centre_x = (xz * (yy - root) - yz * xy) / determinant
    centre_y = (yz * (xx - root) - xz * xy) / determinant
    return centre_x, centre_y, np.sqrt(centre_x**2 + centre_y**2 + mean)


def occupied(angles):
    hit = np.zeros(360, bool)
    hit[angles] = True
    at = np.flatnonzero(hit)
    return 360 - (np.diff(np.append(at, at[0] + 360)) - 1).max()


def revolute(local):
    frames, features, _ = local.shape
    points = local.transpose(1, 0, 2)
    mean = points.mean(1, keepdims=True)
    points = points - mean
    _, axes = np.linalg.eigh(points.swapaxes(1, 2) @ points / frames)
    plane = (points @ axes)[:, :, ::-1]
    x, y = plane[..., 0], plane[..., 1]
    centre_x, centre_y, radius = taubin(x, y)
    x = (x - centre_x[:, None]) / radius[:, None]
    y = (y - centre_y[:, None]) / radius[:, None]
    on_circle = (np.abs(np.hypot(x, y) - 1) <= 0.03).mean()
    angles = np.floor(np.degrees(np.arctan2(y, x)) % 360).astype(int) % 360
    angle = np.mean([occupied(angles[f]) for f in range(features)])
    centres = mean[:, 0] + np.einsum("fij,fj->fi", axes, np.stack([np.zeros(features), centre_y, centre_x], 1))
    off = centres - centres.mean(0)
    axis = np.linalg.eigh(off.T @ off)[1][:, 2]
    along = off @ axis
    axis_fit = (np.linalg.norm(np.cross(off, axis), axis=1) < 0.1 * np.ptp(along)).mean()
    return on_circle * (1 - q_function(angle, 20.0, 0.5)) * axis_fit


def path(frames):
    return np.linalg.norm(np.diff(frames, axis=0), axis=2).sum(0).mean()


def detect(reference, moving):
    rotation, translation = register(reference[0], reference)
    local = (moving - translation[:, None]) @ rotation
    register(local[0], local)  # The relative poses.
    ratio = path(local) / max(min(path(reference), path(moving)), 1e-12)
    return np.exp(-3 * np.pi * ratio**2), prismatic(local), revolute(local)


def load(source):
    if source.suffix == ".npz":
        archive = np.load(source)
        points, ids = archive["points"], archive["body_ids"]
        return np.stack([points[:, ids == body] for body in np.unique(ids)])
    sizes = np.fromfile(source / "shape.f64").astype(int)
    return np.fromfile(source / "bodies.f64").reshape(*sizes, 3)


bodies = load(Path(sys.argv[1]))
print("ready", flush=True)
for line in sys.stdin:
    pairs, *before = map(int, line.split())
    for _ in range(sum(before)):
        detect(bodies[0], bodies[1])
    start = time.process_time()
    for k in range(pairs):
        scores = detect(bodies[k], bodies[k + 1])
    seconds = time.process_time() - start
    print(repr(seconds / pairs), *(repr(float(score)) for score in scores), flush=True)
