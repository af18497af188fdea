"""Reference implementation of the joint detection method of the thesis.

This file is written to be read next to the text, not to be fast.  Equation
numbers are those of the thesis; where the printed formula is wrong or open, the
choice is marked "choice".  Only numpy is needed.

    from thesis import detect
    result = detect(A, B)       # A, B: arrays (frames, features, 3)

A is the reference body, B the moving body.  Every feature must be seen in every
frame; the two bodies may have different numbers of features.

`python3 thesis.py` runs a few checks against numbers that are known in advance.
"""

import math

import numpy as np

# Parameters of the method.
TUBE = 0.1            # prismatic tube radius / distance start-end     (5.2)
SECTIONS = 10         # pieces the tube is cut into                    (5.2)
LENGTH_MU, LENGTH_LAMBDA = 0.93, 40.0                                # (eq 19)
BAND = 0.03           # accepted deviation from the unit circle        (5.3)
ANGLE_MU, ANGLE_LAMBDA = 20.0, 0.5                                   # (eq 42)
AXIS_TUBE = 0.1       # axis tube radius / extent of the centres       (eq 43)
RIGID_LAMBDA = 3.0                                                   # (eq 47)
STILL = 1e-9          # metres: a relative path below this is none     (eq 45)


# --------------------------------------------------------------------------
# Score functions
# --------------------------------------------------------------------------

def q_function(x, mu, lam):
    """Eq 18.  Choice: the usual erf with the factor 2/sqrt(pi)."""
    return 0.5 * (1.0 - math.erf((x - mu) * lam / math.sqrt(2.0)))


def lines_equal_score(mean_length):
    """Eq 19."""
    return 1.0 - q_function(mean_length, LENGTH_MU, LENGTH_LAMBDA)


def occupied_angle_score(mean_angle_deg):
    """Eq 42."""
    return 1.0 - q_function(mean_angle_deg, ANGLE_MU, ANGLE_LAMBDA)


def rigid_score(f):
    """Eq 47."""
    return math.exp(-RIGID_LAMBDA * math.pi * f * f)


# --------------------------------------------------------------------------
# Section 4: relative motion
# --------------------------------------------------------------------------

def register(P, Q):
    """Least squares pose with Q ~ R P + T, as a 4 x 4 matrix (eq 1-12, Alg 2).

    Choice: H = sum p' q'^T and R = V U^T; a reflection is always repaired by
    flipping the column of V that belongs to the smallest singular value.
    """
    p_c, q_c = P.mean(axis=0), Q.mean(axis=0)
    H = (P - p_c).T @ (Q - q_c)
    U, _, Vt = np.linalg.svd(H)            # singular values in falling order
    V = Vt.T
    if np.linalg.det(V @ U.T) < 0.0:
        V = V.copy()
        V[:, 2] = -V[:, 2]
    R = V @ U.T
    pose = np.eye(4)
    pose[:3, :3] = R
    pose[:3, 3] = q_c - R @ p_c
    return pose


def transform(pose, points):
    return points @ pose[:3, :3].T + pose[:3, 3]


def local_motion(A, B):
    """Algorithm 3: the motion of B as seen by an observer fixed to A."""
    local = np.empty_like(B)
    local[0] = B[0]
    complete = np.eye(4)
    for i in range(len(A) - 1):
        step = register(A[i], A[i + 1])
        complete = step @ complete
        local[i + 1] = transform(np.linalg.inv(complete), B[i + 1])
    return local


def mean_path_length(body):
    """Mean over the features of the summed distances between frames."""
    steps = np.linalg.norm(np.diff(body, axis=0), axis=2)   # (frames-1, features)
    return steps.sum(axis=0).mean()


def motion_ratio(dist_a, dist_b, dist_r):
    """Eq 45.  Choice for a still body: 0 if nothing moved, else infinity."""
    smaller = min(dist_a, dist_b)
    if smaller == 0.0:
        return 0.0 if dist_r < STILL else math.inf
    return dist_r / smaller


# --------------------------------------------------------------------------
# Section 5.2: cylinder fit
# --------------------------------------------------------------------------

def extent(trajectory):
    """Largest distance between any two samples of one trajectory."""
    differences = trajectory[:, None, :] - trajectory[None, :, :]
    return np.linalg.norm(differences, axis=2).max()


def fit_cylinder(local):
    """Cylinder score, lengths and direction; `local` is (frames, features, 3)."""
    n_features = local.shape[1]
    lengths = np.array([extent(local[:, i]) for i in range(n_features)])
    if lengths.max() == 0.0:
        # Nothing moves at all.  Not covered by the thesis; no prismatic motion.
        return dict(cylinder_fit=0.0, mean_length=0.0, lines_equal=0.0,
                    direction=np.zeros(3), lengths=lengths,
                    section_inside=[0] * SECTIONS, section_total=[0] * SECTIONS)

    # Reference trajectory (choice: largest extent), its start and far end.
    reference = local[:, int(np.argmax(lengths))]
    start = reference[0]
    end = reference[int(np.argmax(np.linalg.norm(reference - start, axis=1)))]
    length = np.linalg.norm(end - start)

    # Eq 13 (choice): all trajectories begin at the start of the reference one.
    shifted = (local - local[0] + start).reshape(-1, 3)

    # Eq 14, and the position along the line.
    distance = np.linalg.norm(np.cross(shifted - start, shifted - end), axis=1) / length
    inside = distance < TUBE * length
    along = (shifted - start) @ (end - start) / length**2

    # Choice: samples beyond the ends belong to the first and last section.
    section = np.clip(np.floor(along * SECTIONS).astype(int), 0, SECTIONS - 1)
    total = [int((section == s).sum()) for s in range(SECTIONS)]
    hits = [int((inside & (section == s)).sum()) for s in range(SECTIONS)]
    # Choice: the worst section counts, empty sections are left out.
    cylinder_fit = min(h / t for h, t in zip(hits, total) if t > 0)

    mean_length = float((lengths / lengths.max()).mean())
    return dict(cylinder_fit=cylinder_fit, mean_length=mean_length,
                lines_equal=lines_equal_score(mean_length),
                direction=(end - start) / length, lengths=lengths,
                section_inside=hits, section_total=total)


# --------------------------------------------------------------------------
# Section 5.3: circle fit
# --------------------------------------------------------------------------

def taubin_circle(xy):
    """Taubin's circle fit through 2-D points: centre and radius.

    The circle is a (x^2 + y^2) + b x + c y + d = 0.  Taubin minimises the mean
    squared value of the left side under the condition that the mean squared
    length of its gradient is one.  With centred points and
    s = x^2 + y^2, eliminating d leaves a (s - mean s) + b x + c y under the
    condition 4 a^2 mean(s) + b^2 + c^2 = 1.  After the substitution
    a' = 2 sqrt(mean s) a the condition is that (a', b, c) has length one, so the
    answer is the right singular vector of the smallest singular value of the
    matrix with the rows ((s - mean s) / (2 sqrt(mean s)), x, y).  No moments are
    squared, hence no loss of digits.
    """
    middle = xy.mean(axis=0)
    x, y = (xy - middle).T
    s = x * x + y * y
    s_mean = s.mean()
    root = 2.0 * math.sqrt(s_mean)
    if root == 0.0:
        raise ValueError("no circle: all points are the same")
    matrix = np.column_stack([(s - s_mean) / root, x, y])
    a, b, c = np.linalg.svd(matrix, full_matrices=False)[2][2]
    if a == 0.0:
        raise ValueError("no circle: the points lie exactly on a line")
    a /= root
    d = -a * s_mean
    centre = np.array([-b, -c]) / (2.0 * a)
    radius = math.sqrt(b * b + c * c - 4.0 * a * d) / (2.0 * abs(a))
    return centre + middle, radius


def occupied_degrees(angles):
    """360 minus the longest circular run of empty one-degree bins."""
    bins = np.floor(np.degrees(angles) % 360.0).astype(int) % 360
    filled = np.unique(bins)
    gaps = np.diff(np.append(filled, filled[0] + 360)) - 1   # empty bins between
    return 360 - int(gaps.max())


def fit_circle(trajectory):
    """One trajectory: share in the band, occupied angle, 3-D centre, radius."""
    mean = trajectory.mean(axis=0)
    # Plane by PCA (eq 21-37).  The right singular vectors of the centred points
    # are the eigenvectors of K; the last one is the normal.  The other two are
    # the axes of the plane.  Their order and signs do not change the occupied
    # angle: they only turn the histogram by 90 degrees or mirror it.
    axes = np.linalg.svd(trajectory - mean, full_matrices=False)[2]
    flat = (trajectory - mean) @ axes[:2].T
    centre, radius = taubin_circle(flat)
    unit = (flat - centre) / radius                               # eq 38, 39
    distance = np.hypot(unit[:, 0], unit[:, 1])                   # eq 40
    inside = int((np.abs(distance - 1.0) <= BAND).sum())
    angle = occupied_degrees(np.arctan2(unit[:, 1], unit[:, 0]))
    return dict(inside=inside, share=inside / len(trajectory), angle=angle,
                centre=mean + centre @ axes[:2], radius=radius)


def fit_axis(centres):
    """Line through the circle centres by PCA, and eq 43."""
    point = centres.mean(axis=0)
    direction = np.linalg.svd(centres - point, full_matrices=False)[2][0]
    along = (centres - point) @ direction
    distance = np.linalg.norm((centres - point) - np.outer(along, direction), axis=1)
    # Choice: radius from the extent of the centres along the line.
    radius = AXIS_TUBE * (along.max() - along.min())
    inside = int((distance < radius).sum())
    return dict(point=point, direction=direction, inside=inside,
                share=inside / len(centres))


# --------------------------------------------------------------------------
# All together
# --------------------------------------------------------------------------

def detect(A, B):
    """Confidences and all partial scores for the pair (A reference, B moving)."""
    A, B = np.asarray(A, float), np.asarray(B, float)
    local = local_motion(A, B)

    # Rigid (eq 45, 47).
    dist_a, dist_b, dist_r = (mean_path_length(body) for body in (A, B, local))
    f = motion_ratio(dist_a, dist_b, dist_r)
    p_rigid = rigid_score(f)

    # Prismatic (eq 20).
    cylinder = fit_cylinder(local)
    p_prismatic = cylinder["lines_equal"] * cylinder["cylinder_fit"]

    # Revolute (eq 44).
    circles = [fit_circle(local[:, i]) for i in range(local.shape[1])]
    circle_fit = float(np.mean([c["share"] for c in circles]))
    mean_angle = float(np.mean([c["angle"] for c in circles]))
    p_angle = occupied_angle_score(mean_angle)
    centres = np.array([c["centre"] for c in circles])
    axis = fit_axis(centres)
    p_revolute = circle_fit * p_angle * axis["share"]

    return dict(
        # Confidences, eq 48-51.
        confidence_rigid=p_rigid,
        confidence_prismatic=(1 - p_rigid) * p_prismatic,
        confidence_revolute=(1 - p_rigid) * (1 - p_prismatic) * p_revolute,
        confidence_disconnected=(1 - p_rigid) * (1 - p_prismatic) * (1 - p_revolute),
        # Rigid.
        motion_ratio=f,
        dist_reference=dist_a,
        dist_moving=dist_b,
        dist_relative=dist_r,
        rigid=p_rigid,
        # Prismatic.
        cylinder_fit=cylinder["cylinder_fit"],
        lines_equal=cylinder["lines_equal"],
        prismatic=p_prismatic,
        prismatic_direction=cylinder["direction"],
        # Revolute.
        circle_fit=circle_fit,
        occupied_angle_deg=mean_angle,
        occupied_angle=p_angle,
        axis_fit=axis["share"],
        revolute=p_revolute,
        axis_point=axis["point"],
        axis_direction=axis["direction"],
        # What the scores were made of; handy when two programs disagree.
        details=dict(
            mean_length=cylinder["mean_length"],
            lengths=cylinder["lengths"],
            section_inside=cylinder["section_inside"],
            section_total=cylinder["section_total"],
            circle_inside=[c["inside"] for c in circles],
            angles_deg=[c["angle"] for c in circles],
            radii=[c["radius"] for c in circles],
            centres=centres,
            axis_inside=axis["inside"],
        ),
    )


# --------------------------------------------------------------------------
# Checks with known answers
# --------------------------------------------------------------------------

def taubin_by_eigenvalues(xy):
    """The same fit as a generalized eigenproblem, only to check taubin_circle.

    Minimise v^T M v / v^T N v over v = (a, b, c, d), with M the moment matrix of
    (s, x, y, 1) and N the mean outer product of the gradients.
    """
    middle = xy.mean(axis=0)
    x, y = (xy - middle).T
    s = x * x + y * y
    Z = np.column_stack([s, x, y, np.ones_like(x)])
    M = Z.T @ Z / len(x)
    N = np.zeros((4, 4))
    N[0, 0] = 4.0 * s.mean()
    N[0, 1] = N[1, 0] = 2.0 * x.mean()
    N[0, 2] = N[2, 0] = 2.0 * y.mean()
    N[1, 1] = N[2, 2] = 1.0
    # N v mu = M v  <=>  (1/mu) v = M^-1 N v; the smallest mu is wanted.
    values, vectors = np.linalg.eig(np.linalg.solve(M, N))
    a, b, c, d = np.real(vectors[:, np.argmax(np.real(values))])
    radius = math.sqrt(b * b + c * c - 4.0 * a * d) / (2.0 * abs(a))
    return np.array([-b, -c]) / (2.0 * a) + middle, radius


def self_check():
    rng = np.random.default_rng(1)

    value = lines_equal_score(1.0)
    print(f"eq 19 at mean length 1      {value:.5f}   expected 0.99744")
    assert abs(value - 0.99744) < 5e-6

    value = rigid_score(0.27)
    print(f"eq 47 at f = 0.27           {value:.5f}   expected about 0.503")
    assert abs(value - 0.503) < 1e-3

    # Registration recovers a pose, also for a flat and noisy body.
    worst = 0.0
    for flat in (False, True):
        for _ in range(200):
            P = rng.uniform(-0.2, 0.2, (10, 3))
            if flat:
                P[:, 2] = 0.0
            R = np.linalg.qr(rng.normal(size=(3, 3)))[0]
            R *= np.linalg.det(R)
            T = rng.normal(size=3)
            Q = P @ R.T + T + 1e-9 * rng.normal(size=P.shape)
            pose = register(P, Q)
            worst = max(worst, np.abs(pose[:3, :3] - R).max(), np.abs(pose[:3, 3] - T).max())
    print(f"registration, worst error   {worst:.1e}   expected about 1e-8 (noise 1e-9)")
    assert worst < 1e-7

    # Both forms of Taubin's fit agree.
    worst = 0.0
    for arc in (25, 60, 180, 330):
        t = np.radians(np.sort(rng.uniform(0, arc, 30)))
        xy = 0.3 * np.column_stack([np.cos(t), np.sin(t)]) + [0.7, -0.4]
        xy += 1e-3 * rng.normal(size=xy.shape)
        (c1, r1), (c2, r2) = taubin_circle(xy), taubin_by_eigenvalues(xy)
        worst = max(worst, np.abs(c1 - c2).max(), abs(r1 - r2))
    print(f"Taubin, two forms           {worst:.1e}   expected below 1e-9")
    assert worst < 1e-9

    # Occupied angle.
    assert occupied_degrees(np.radians([359.5, 0.5, 10.5])) == 12
    assert occupied_degrees(np.radians([271.38])) == 1

    # An arc leaves the tube round its chord from 45.2 degrees on.
    print("arc inside the tube below 45.2 deg:", end=" ")
    for arc in (45.0, 45.4):
        t = np.radians(np.linspace(0, arc, 2001))
        traj = np.column_stack([np.cos(t), np.sin(t), 0 * t])[:, None, :]
        print(f"{arc}: {fit_cylinder(traj)['cylinder_fit']:.2f}", end="  ")
    print()

    # Table 2: still base without noise, 20 features, 20 frames, 1 m of travel.
    print("Table 2 (mean prismatic confidence of 200 runs)")
    slide = np.linspace(0, 1, 20)[:, None, None] * np.array([1.0, 0.0, 0.0])
    for percent, printed in ((0.38, 0.992), (0.95, 0.961), (1.9, 0.769), (3.8, 0.236)):
        scores = []
        for _ in range(200):
            A = np.repeat(rng.uniform(-0.5, 0.5, (1, 20, 3)), 20, axis=0)
            B = rng.uniform(-0.5, 0.5, (1, 20, 3)) + slide
            B = B + percent / 100 * rng.normal(size=B.shape)
            scores.append(detect(A, B)["confidence_prismatic"])
        mean = float(np.mean(scores))
        print(f"  noise {percent:4.2f} % of the travel: {mean:.3f}   printed {printed}")
        assert abs(mean - printed) < 0.03


if __name__ == "__main__":
    self_check()
