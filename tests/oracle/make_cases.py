"""Write the test recordings and what the reference implementation says of them.

    python3 make_cases.py

writes cases/NAME.csv (header frame,body,feature,x,y,z; metres; bodies
`reference` and `moving`), cases/NAME.json and the table in README.md.

A recording is made from three parts: the pose G(t) of the base, the joint J(t)
in the base frame, and the features a (base) and b (moving part):

    reference(t) = G(t) a        moving(t) = G(t) J(t) b

Time runs in uneven steps, so that no sample falls on the edge of a tube section
or of a one-degree bin by symmetry.  Noisy coordinates are rounded to 0.1
micrometre to keep the files small; clean ones are written in full.

A case is kept only if noise of 1e-12 m on every coordinate moves no score by
more than 1e-9, and if noise of 1e-10 m changes no count at all.  If not, the
next seed is tried.
"""

import csv
import json
import math
import sys
from pathlib import Path

import numpy as np

sys.dont_write_bytecode = True
from thesis import detect  # noqa: E402

HERE = Path(__file__).resolve().parent
OUT = HERE / "cases"

CONFIDENCES = ["confidence_rigid", "confidence_prismatic", "confidence_revolute",
               "confidence_disconnected"]
SCORES = CONFIDENCES + [
    "motion_ratio", "dist_reference", "dist_moving", "dist_relative", "rigid",
    "cylinder_fit", "lines_equal", "prismatic",
    "circle_fit", "occupied_angle_deg", "occupied_angle", "axis_fit", "revolute"]
COUNTS = ["section_inside", "section_total", "circle_inside", "angles_deg", "axis_inside"]


# --------------------------------------------------------------------------
# Motions
# --------------------------------------------------------------------------

def rotation(axis, angle):
    """Rotation about a direction through the origin (Rodrigues)."""
    x, y, z = np.asarray(axis, float) / np.linalg.norm(axis)
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle) * K + (1 - math.cos(angle)) * (K @ K)


def uneven_times(rng, frames):
    """From 0 to 1 in steps that differ by up to a factor of two or so."""
    t = np.concatenate([[0.0], np.cumsum(rng.uniform(0.65, 1.35, frames - 1))])
    return t / t[-1]


def still_base(rng):
    R = rotation(rng.normal(size=3), rng.uniform(0.3, 2.0))
    T = np.array([0.4, -0.3, 1.2]) + rng.uniform(-0.1, 0.1, 3)
    return lambda t: (R, T)


def moving_base(rng, travel=0.15, turn_deg=15.0):
    """A curved path of about `travel` metres with a slow turn."""
    R0, T0 = still_base(rng)(0.0)
    axis = rng.normal(size=3)
    go = rng.normal(size=3)
    go /= np.linalg.norm(go)
    side = np.cross(go, rng.normal(size=3))
    side /= np.linalg.norm(side)

    def pose(t):
        R = rotation(axis, math.radians(turn_deg) * (t + 0.15 * math.sin(4 * t))) @ R0
        T = T0 + travel * (t * go + 0.15 * math.sin(math.pi * t) * side)
        return R, T
    return pose


def rigid():
    return lambda t: (np.eye(3), np.zeros(3))


def slide(direction, travel):
    d = np.asarray(direction, float) / np.linalg.norm(direction)
    return lambda t: (np.eye(3), travel * t * d)


def bowed_slide(travel, bow):
    """A slide along x whose rail bends sideways by `bow`, lopsided."""
    def joint(t):
        side = bow * (math.sin(math.pi * t) + 0.2 * math.sin(2 * math.pi * t))
        return np.eye(3), np.array([travel * t, side, 0.0])
    return joint


def hinge(degrees, pitch=0.0):
    """Turn about the z axis, with `pitch` metres per turn along it."""
    def joint(t):
        return (rotation([0, 0, 1], math.radians(degrees) * t),
                np.array([0.0, 0.0, pitch * degrees / 360 * t]))
    return joint


def planar_bend(first, second, turn_deg):
    """In the x-y plane: forward, round a bend to the side, turning a little."""
    def joint(t):
        s = 1 / (1 + math.exp(-12 * (t - 0.5)))
        x = first * (t + (0.5 - t) * s)
        y = second * s * t
        return rotation([0, 0, 1], math.radians(turn_deg) * t), np.array([x, y, 0.0])
    return joint


def free(rng):
    """Six slow oscillations that have nothing to do with each other."""
    amplitude = rng.uniform(0.05, 0.12, 3)
    speed, phase = rng.uniform(2.0, 6.0, 6), rng.uniform(0, 6.28, 6)
    tilt = np.radians(rng.uniform(10, 25, 3))

    def joint(t):
        wave = np.sin(speed * t + phase)
        R = np.eye(3)
        for k in range(3):
            R = rotation(np.eye(3)[k], tilt[k] * wave[3 + k]) @ R
        return R, amplitude * wave[:3]
    return joint


# --------------------------------------------------------------------------
# Features
# --------------------------------------------------------------------------

def box(rng, n, low, high):
    """n features anywhere in a box."""
    return rng.uniform(low, high, (n, 3))


def ring(rng, n, radius, angle_deg, height):
    """n features at given ranges of distance, angle and height about z.

    The heights are spread evenly and then shaken, so that the circle centres
    span the axis well.
    """
    r = rng.uniform(*radius, n)
    a = np.radians(rng.uniform(*angle_deg, n))
    low, high = height
    z = low + (high - low) * (np.arange(n) + rng.uniform(0.2, 0.8, n)) / n
    return np.column_stack([r * np.cos(a), r * np.sin(a), z])


# --------------------------------------------------------------------------
# Cases: name, text, frames, features (reference, moving), noise, and a function
# of the random generator giving base pose, joint and moving features.
# --------------------------------------------------------------------------

BASE_BOX = ([-0.2, -0.15, -0.15], [0.2, 0.15, 0.15])
NOISE = 1e-4

CASES = [
    ("rigid_noise", "two bodies that move together", 30, (10, 10), NOISE,
     lambda g: (moving_base(g, 0.25, 30), rigid(), box(g, 10, [0.1, -0.2, -0.1], [0.4, 0.2, 0.2]))),
    ("prismatic_moving_noise", "slide of 20 cm, moving base", 30, (10, 10), NOISE,
     lambda g: (moving_base(g), slide([1, 0.3, -0.2], 0.20), box(g, 10, [0.1, -0.2, -0.1], [0.4, 0.2, 0.2]))),
    ("prismatic_still", "slide of 20 cm with noise; base exactly still, f is infinite",
     30, (8, 12), NOISE,
     lambda g: (still_base(g), slide([0.2, 1, 0.1], 0.20), box(g, 12, [0.1, -0.2, -0.1], [0.4, 0.2, 0.2]))),
    ("prismatic_bowed_clean", "slide of 20 cm on a rail with 3 mm of bow, moving base",
     25, (8, 8), 0.0,
     lambda g: (moving_base(g), bowed_slide(0.20, 0.003), box(g, 8, [0.1, -0.2, -0.1], [0.4, 0.2, 0.2]))),
    ("revolute_90_clean", "hinge, 90 deg, moving base", 25, (8, 8), 0.0,
     lambda g: (moving_base(g), hinge(90), ring(g, 8, (0.1, 0.4), (-20, 20), (0, 0.3)))),
    ("revolute_90_noise", "hinge, 90 deg, moving base", 30, (10, 10), NOISE,
     lambda g: (moving_base(g), hinge(90), ring(g, 10, (0.1, 0.4), (-20, 20), (0, 0.4)))),
    ("revolute_25_noise", "hinge, 25 deg, moving base", 30, (10, 10), NOISE,
     lambda g: (moving_base(g), hinge(25), ring(g, 10, (0.1, 0.5), (-15, 15), (0, 0.5)))),
    ("revolute_20_far_noise", "hinge, 20 deg, features 0.6 to 1.2 m from the axis, moving base",
     35, (10, 10), NOISE,
     lambda g: (moving_base(g), hinge(20), ring(g, 10, (0.6, 1.2), (-10, 10), (-0.3, 0.4)))),
    ("revolute_300_noise", "hinge, 300 deg, moving base", 40, (9, 9), NOISE,
     lambda g: (moving_base(g), hinge(300), ring(g, 9, (0.05, 0.2), (-180, 180), (0, 0.25)))),
    ("small_arc_17_clean", "hinge, 17 deg, moving base", 25, (8, 8), 0.0,
     lambda g: (moving_base(g), hinge(17), ring(g, 8, (0.1, 0.5), (-15, 15), (0, 0.4)))),
    ("screw_clean", "screw, 330 deg at 30 cm per turn, moving base", 25, (8, 8), 0.0,
     lambda g: (moving_base(g), hinge(330, 0.30), ring(g, 8, (0.04, 0.15), (-90, 90), (0, 0.25)))),
    ("planar_bend_noise", "planar path with a bend, 25 deg of turn, moving base", 35, (10, 10), NOISE,
     lambda g: (moving_base(g), planar_bend(0.25, 0.2, 25), box(g, 10, [0.0, -0.2, -0.2], [0.3, 0.2, 0.2]))),
    ("free_clean", "six degrees of freedom, moving base", 25, (8, 8), 0.0,
     lambda g: (moving_base(g), free(g), box(g, 8, [0.1, -0.2, -0.1], [0.4, 0.2, 0.2]))),
    ("drawer_30mm_noise", "slide of 30 mm on a base that moves 15 cm", 30, (10, 10), NOISE,
     lambda g: (moving_base(g, 0.15, 5), slide([1, 0, 0], 0.03), box(g, 10, [0.1, -0.2, -0.1], [0.4, 0.2, 0.2]))),
    ("handle_30_noise", "hinge, 30 deg, features only round the door handle, moving base",
     30, (10, 9), NOISE,
     lambda g: (moving_base(g), hinge(30), ring(g, 9, (0.70, 0.74), (-2, 2), (0.85, 1.15)))),
    ("handle_46_sparse_clean", "hinge, 46 deg, features near the door edge, 8 frames only, "
     "moving base", 8, (8, 8), 0.0,
     lambda g: (moving_base(g), hinge(46), ring(g, 8, (0.62, 0.74), (-3, 3), (0.7, 1.2)))),
    ("revolute_60_coarse_noise", "hinge, 60 deg, moving base", 20, (8, 8), 2e-3,
     lambda g: (moving_base(g), hinge(60), ring(g, 8, (0.08, 0.25), (-20, 20), (0, 0.2)))),
]


def make(case, rng):
    """Coordinates of one case: A, B as arrays (frames, features, 3)."""
    name, _, frames, (n_reference, _), noise, parts = case
    times = uneven_times(rng, frames)
    base, joint, b = parts(rng)
    a = box(rng, n_reference, *BASE_BOX)
    A, B = [], []
    for t in times:
        RG, TG = base(t)
        RJ, TJ = joint(t)
        A.append(a @ RG.T + TG)
        B.append((b @ RJ.T + TJ) @ RG.T + TG)
    A, B = np.array(A), np.array(B)
    if noise > 0:
        if name == "prismatic_still":
            A = np.repeat(np.round(A[:1], 7), frames, axis=0)
        else:
            A = np.round(A + noise * rng.normal(size=A.shape), 7)
        B = np.round(B + noise * rng.normal(size=B.shape), 7)
    return A, B


# --------------------------------------------------------------------------
# Files
# --------------------------------------------------------------------------

def write_csv(path, A, B):
    with open(path, "w", newline="") as file:
        file.write("frame,body,feature,x,y,z\n")
        for frame in range(len(A)):
            for body, points in (("reference", A[frame]), ("moving", B[frame])):
                for feature, (x, y, z) in enumerate(points):
                    file.write(f"{frame},{body},{feature},{float(x)!r},{float(y)!r},{float(z)!r}\n")


def read_csv(path):
    bodies = {"reference": {}, "moving": {}}
    with open(path, newline="") as file:
        for row in csv.DictReader(file):
            key = int(row["frame"]), int(row["feature"])
            bodies[row["body"]][key] = [float(row[c]) for c in "xyz"]
    arrays = []
    for samples in bodies.values():
        frames = 1 + max(k[0] for k in samples)
        features = 1 + max(k[1] for k in samples)
        arrays.append(np.array([[samples[i, j] for j in range(features)] for i in range(frames)]))
    return arrays


def to_json(value, indent=0):
    """JSON with 17 significant digits; infinity becomes the string "inf"."""
    if isinstance(value, dict):
        pad = "  " * (indent + 1)
        items = [f"{pad}{json.dumps(k)}: {to_json(v, indent + 1)}" for k, v in value.items()]
        return "{\n" + ",\n".join(items) + "\n" + "  " * indent + "}"
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(to_json(v, indent) for v in value) + "]"
    if isinstance(value, (int, np.integer)):
        return str(int(value))
    if isinstance(value, (float, np.floating)):
        if math.isinf(value):
            return '"inf"'
        text = format(float(value), ".17g")
        return text if any(c in text for c in ".en") else text + ".0"
    return json.dumps(value)


# --------------------------------------------------------------------------
# Robustness
# --------------------------------------------------------------------------

def change(a, b):
    """Difference of two scores; 0 for inf against inf."""
    return 0.0 if a == b else abs(a - b)


def line_change(d, e):
    """Difference of two directions, whichever way they point."""
    return min(np.abs(d - e).max(), np.abs(d + e).max())


def robustness(A, B, result):
    """Largest changes under tiny noise, or None if the case must not be kept."""
    rng = np.random.default_rng(12345)
    # A base that is still to the last digit has to stay so: with any noise on it
    # f would be finite.  Its confidences are tested with noise all the same.
    still = bool((A == A[0]).all())
    worst = dict(score=0.0, axis_point=0.0, axis_direction=0.0, prismatic_direction=0.0)

    def disturbed(size, disturb_reference=True):
        a = A + size * rng.normal(size=A.shape) if disturb_reference else A
        return detect(a, B + size * rng.normal(size=B.shape))

    for _ in range(10):
        other = disturbed(1e-12, not still)
        worst["score"] = max([worst["score"]] + [change(result[k], other[k]) for k in SCORES])
        for key, difference in (
                ("axis_point", np.abs(result["axis_point"] - other["axis_point"]).max()),
                ("axis_direction", line_change(result["axis_direction"], other["axis_direction"])),
                ("prismatic_direction", np.abs(result["prismatic_direction"]
                                               - other["prismatic_direction"]).max())):
            worst[key] = max(worst[key], float(difference))
        if still:
            other = disturbed(1e-12)
            worst["score"] = max([worst["score"]] + [change(result[k], other[k]) for k in CONFIDENCES])
    if worst["score"] > 1e-9:
        return None
    for _ in range(5):
        other = disturbed(1e-10, not still)
        if any(result["details"][k] != other["details"][k] for k in COUNTS):
            return None
    return worst


# --------------------------------------------------------------------------

def table(rows):
    head = ("| case | what | frames | features | noise | rigid | prismatic | revolute | disconnected "
            "| f | cylinder | lengths | circle | angle | axis |\n"
            "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n")
    lines = []
    for name, text, frames, (n_a, n_b), noise, r in rows:
        numbers = " | ".join(f"{r[k]:.3f}" for k in CONFIDENCES + ["motion_ratio"])
        parts = " | ".join(f"{r[k]:.3f}" for k in ("cylinder_fit", "lines_equal", "circle_fit"))
        lines.append(f"| {name} | {text} | {frames} | {n_a}+{n_b} | {f'{1000 * noise:g} mm' if noise else 'none'} | "
                     f"{numbers} | {parts} | {r['occupied_angle_deg']:.1f} | {r['axis_fit']:.3f} |\n")
    return head + "".join(lines)


def main():
    OUT.mkdir(exist_ok=True)
    rows, size = [], 0
    for number, case in enumerate(CASES):
        name, text, frames, features, noise, _ = case
        for seed in range(1000 * (number + 1), 1000 * (number + 1) + 200):
            A, B = make(case, np.random.default_rng(seed))
            result = detect(A, B)
            worst = robustness(A, B, result)
            if worst is not None:
                break
        else:
            raise SystemExit(f"{name}: no robust seed found")
        write_csv(OUT / f"{name}.csv", A, B)
        A2, B2 = read_csv(OUT / f"{name}.csv")
        assert (A == A2).all() and (B == B2).all()
        document = dict(case=name, description=text, seed=seed, frames=frames,
                        features_reference=features[0], features_moving=features[1],
                        noise_m=noise, **result,
                        change_under_1e_12_m=worst)
        (OUT / f"{name}.json").write_text(to_json(document) + "\n")
        rows.append((name, text, frames, features, noise, result))
        size += (OUT / f"{name}.csv").stat().st_size
        print(f"{name:24s} seed {seed}  " + "  ".join(f"{result[k]:.4f}" for k in CONFIDENCES)
              + "  worst " + " ".join(f"{v:.0e}" for v in worst.values()))
    print(f"{len(rows)} cases, {size / 1024:.0f} KB of CSV")

    readme = HERE / "README.md"
    if readme.exists():
        text = readme.read_text()
        begin, end = "<!-- table -->\n", "<!-- end of table -->"
        if begin in text and end in text:
            head, tail = text.split(begin)[0], text.split(end)[1]
            readme.write_text(head + begin + table(rows) + end + tail)


if __name__ == "__main__":
    main()
