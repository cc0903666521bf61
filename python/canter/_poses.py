"""Poses in the forms that people write them."""

from __future__ import annotations

import numpy as np

from ._arrays import Array, Numbers, array, poses


def pose(
    xyz: Numbers = (0.0, 0.0, 0.0),
    rpy: Numbers | None = None,
    *,
    quaternion: Numbers | None = None,
    z_axis: Numbers | None = None,
    x_axis: Numbers | None = None,
) -> Array:
    """A pose (4, 4) at `xyz` (m).

    Its orientation comes from `rpy` (roll, pitch, yaw about the fixed x, y and z axes, rad), from a
    `quaternion` (w, x, y, z) or from the directions of its `z_axis` and `x_axis`, as in programs.
    Without any of them it is not turned.

    >>> import canter
    >>> canter.pose([0.4, 0.1, 0.3], z_axis=[0, 0, -1], x_axis=[1, 0, 0])[:3, 2]
    array([ 0.,  0., -1.])
    """
    out = np.eye(4)
    out[:3, 3] = array(xyz, "xyz").reshape(3)
    given = [rpy is not None, quaternion is not None, z_axis is not None or x_axis is not None]
    if sum(given) > 1:
        raise ValueError("expected one of rpy, quaternion, or z_axis with x_axis")
    if rpy is not None:
        roll, pitch, yaw = array(rpy, "rpy").reshape(3)
        cr, sr, cp, sp = np.cos(roll), np.sin(roll), np.cos(pitch), np.sin(pitch)
        cy, sy = np.cos(yaw), np.sin(yaw)
        out[:3, :3] = [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    elif quaternion is not None:
        row = np.concatenate([out[:3, 3], array(quaternion, "quaternion").reshape(4)])
        out = matrix(row)
    elif given[2]:
        if z_axis is None or x_axis is None:
            raise ValueError("expected both z_axis and x_axis")
        z, x = array(z_axis, "z_axis").reshape(3), array(x_axis, "x_axis").reshape(3)
        lengths = np.linalg.norm(z), np.linalg.norm(x)
        if min(lengths) == 0 or not np.isfinite(lengths).all():
            raise ValueError("expected axes that are finite and not zero")
        z, x = z / lengths[0], x / lengths[1]
        if abs(z @ x) > 1e-6:
            raise ValueError(f"expected axes at right angles, their product is {z @ x:.6g}")
        out[:3, 2] = z
        out[:3, 1] = np.cross(z, x)
        out[:3, 0] = np.cross(out[:3, 1], z)
    return out


def matrix(pose7: Numbers) -> Array:
    """Poses (..., 4, 4) from rows (..., 7) of x, y, z (m) and qw, qx, qy, qz."""
    rows = array(pose7, "pose7")
    if rows.ndim == 0 or rows.shape[-1] != 7:
        raise ValueError(f"pose7: expected (..., 7), got an array of shape {rows.shape}")
    lengths = np.linalg.norm(rows[..., 3:], axis=-1, keepdims=True)
    if not np.all(lengths > 0):
        raise ValueError("pose7: a quaternion is zero or not a number")
    w, x, y, z = np.moveaxis(rows[..., 3:] / lengths, -1, 0)
    out = np.zeros((*rows.shape[:-1], 4, 4))
    out[..., 0, 0] = 1 - 2 * (y * y + z * z)
    out[..., 0, 1] = 2 * (x * y - w * z)
    out[..., 0, 2] = 2 * (x * z + w * y)
    out[..., 1, 0] = 2 * (x * y + w * z)
    out[..., 1, 1] = 1 - 2 * (x * x + z * z)
    out[..., 1, 2] = 2 * (y * z - w * x)
    out[..., 2, 0] = 2 * (x * z - w * y)
    out[..., 2, 1] = 2 * (y * z + w * x)
    out[..., 2, 2] = 1 - 2 * (x * x + y * y)
    out[..., :3, 3] = rows[..., :3]
    out[..., 3, 3] = 1
    return out


def pose7(pose: Numbers) -> Array:
    """Rows (..., 7) of x, y, z (m) and qw, qx, qy, qz (qw not negative) from poses (..., 4, 4)."""
    m = poses(pose, "pose")
    out = np.empty((*m.shape[:-2], 7))
    out[..., :3] = m[..., :3, 3]
    t = m[..., :3, :3]
    d = np.stack([t[..., 0, 0], t[..., 1, 1], t[..., 2, 2]], axis=-1)
    # Four times the square of each part; the largest one is divided by.
    squares = np.stack(
        [
            1 + d[..., 0] + d[..., 1] + d[..., 2],
            1 + d[..., 0] - d[..., 1] - d[..., 2],
            1 - d[..., 0] + d[..., 1] - d[..., 2],
            1 - d[..., 0] - d[..., 1] + d[..., 2],
        ],
        axis=-1,
    )
    a, b, c = (
        t[..., 2, 1] - t[..., 1, 2],
        t[..., 0, 2] - t[..., 2, 0],
        t[..., 1, 0] - t[..., 0, 1],
    )
    e, f, g = (
        t[..., 1, 0] + t[..., 0, 1],
        t[..., 0, 2] + t[..., 2, 0],
        t[..., 2, 1] + t[..., 1, 2],
    )
    s = squares
    rows = np.stack(
        [
            np.stack([s[..., 0], a, b, c], axis=-1),
            np.stack([a, s[..., 1], e, f], axis=-1),
            np.stack([b, e, s[..., 2], g], axis=-1),
            np.stack([c, f, g, s[..., 3]], axis=-1),
        ],
        axis=-2,
    )
    best = np.argmax(squares, axis=-1)[..., None, None]
    q = np.take_along_axis(rows, np.broadcast_to(best, (*best.shape[:-1], 4)), axis=-2)[..., 0, :]
    q = q / np.linalg.norm(q, axis=-1, keepdims=True)
    out[..., 3:] = np.where(q[..., :1] < 0, -q, q)
    return out
