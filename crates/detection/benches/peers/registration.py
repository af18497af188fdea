#!/usr/bin/env python3
"""W1 registrations in Python. Reads reference.f64 and frames.f64 from the folder given; see ratios/peer.rs."""
import sys
import time
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

folder = Path(sys.argv[1])
reference = np.fromfile(folder / "reference.f64").reshape(-1, 3)
frames = np.fromfile(folder / "frames.f64").reshape(-1, len(reference), 3)
about_centre = reference - reference.mean(0)
LOOP = 1000


def batched():
    """All frames at once; centring one side is enough."""
    u, _, vt = np.linalg.svd(about_centre.T @ frames)
    v, ut = vt.swapaxes(1, 2), u.swapaxes(1, 2)
    sign = np.ones((len(frames), 3))
    sign[:, 2] = np.sign(np.linalg.det(v @ ut))
    rotation = (v * sign[:, None]) @ ut
    translation = frames.mean(1) - rotation @ reference.mean(0)
    return rotation, translation


def align_vectors():
    """Frame by frame, as most scripts do it."""
    rotations = np.empty((LOOP, 3, 3))
    for k in range(LOOP):
        q = frames[k] - frames[k].mean(0)
        rotations[k] = Rotation.align_vectors(q, about_centre)[0].as_matrix()
    return rotations, None


KERNELS = {"numpy": (batched, len(frames)), "scipy": (align_vectors, LOOP)}
print("ready", flush=True)
for line in sys.stdin:
    kernel, count = KERNELS[line.strip()]
    start = time.process_time()
    rotations, _ = kernel()
    seconds = (time.process_time() - start) / count
    sample = rotations[:LOOP:97].ravel()
    print(repr(seconds), *map(repr, sample.tolist()), flush=True)
