"""Calibration from what a strapdown system (SINS) says of attitude and velocity: its equations turned round.

K 2.3 solves the linear error equations 22, 23 for what gyros and accelerometers read wrong,

    ΔΩ = θ' + Ω × θ,     Δn = V' + 2 Ω × V − θ × f,      θ = (α, β, γ), f the specific force       (K 22-26)

with the axes, Ω and f of tables 2.6 to 2.8. K's n is −f: with n_z = −g for Z up it prints −βg in Δn_x, which
is right. Here the navigation equations themselves are turned round, so that errors need not be small: a
scale factor 1 % off turns 30 deg wrong in one 3000 deg turn. Between two samples, dt apart,

    exp(Δθ×) = Cₖᵀ exp(ω_in dt ×) Cₖ₊₁               mean rate read: Δθ / dt
    J(Δθ) Δv = Cₖᵀ exp(ω_in dt/2 ×) [ΔV + ((2 ω_ie + ω_en) × V − g) dt],  J(φ) = ∫₀¹ exp(s φ×) ds

and to first order that is K's. The mean over a record depends on its ends and the sums between, as in K's
appendix 1. References: attitude at the record's first sample, the bench's motion and the Earth's.
Mechanisation: Groves, 2nd edition, 5.4 (local navigation frame), which the system is taken to follow.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planner.errors import InputError
from planner.nouns.array import Array
from planner.nouns.dwell_table import DwellTable
from planner.nouns.navigation_log import NavigationLog, NavigationRecord
from planner.physics import earth, quaternion
from planner.physics.attitude import cross, rotate, rotation_vector_from_dcm, skew

_MOST_TURN = np.radians(120.0)  # between two samples; half a turn would have two directions


def dwells_of(log: NavigationLog) -> DwellTable:
    """The dwell table that the system's own sensors would have given, one row a record, with references.

    Raises InputError for a record that turns too far between two samples.
    """
    found = [readings(record) for record in log.records]
    true = [references(record) for record in log.records]
    records = log.records
    return DwellTable(
        unit=np.array([r.unit for r in records], dtype=np.str_),
        run=np.array([r.run for r in records], dtype=np.int64),
        day=np.array([r.day for r in records]),
        time_on=np.array([0.5 * (r.time_s[0] + r.time_s[-1]) for r in records]),
        duration=np.array([r.time_s[-1] - r.time_s[0] for r in records]),
        temperature_degc=np.array([r.temperature_degc.mean() for r in records]),
        temperature_rate=np.array([_slope(r.time_s, r.temperature_degc) for r in records]),
        ref_rate=np.array([rate for rate, _ in true]),
        ref_acc=np.array([force for _, force in true]),
        gyro=np.array([rate for rate, _ in found]),
        acc=np.array([force for _, force in found]),
        step=np.array([r.name for r in records], dtype=np.str_),
        n_samples=np.array([len(r.time_s) for r in records], dtype=np.int64),
        source=log.source,
        notes=(*log.notes, *_notes(records)),
    )


def readings(record: NavigationRecord) -> tuple[Array, Array]:
    """Mean rate (3,) rad/s and specific force (3,) m/s² that the sensors must have read over the record."""
    dt = np.diff(record.time_s)
    c = direction_cosines(record.attitude)
    before, after = c[:-1], c[1:]
    v = 0.5 * (record.velocity[1:] + record.velocity[:-1])
    latitude, altitude = _where(record, v, dt)
    w_ie = earth.earth_rate_ned(latitude)
    w_en = earth.transport_rate_ned(latitude, altitude, v)
    frame = (w_ie + w_en) * dt[:, None]
    back = before.swapaxes(1, 2)
    angle = rotation_vector_from_dcm(back @ _turn(frame) @ after)
    _refuse_fast(record, angle, dt)
    gravity = earth.gravity_ned(latitude, altitude)
    pushed = np.diff(record.velocity, axis=0) + (cross(2.0 * w_ie + w_en, v) - gravity) * dt[:, None]
    in_body = rotate(back @ _turn(0.5 * frame), pushed)
    velocity = np.linalg.solve(mean_turn(angle), in_body[..., None])[..., 0]
    return angle.sum(axis=0) / dt.sum(), velocity.sum(axis=0) / dt.sum()


def _where(record: NavigationRecord, v: Array, dt: Array) -> tuple[Array, Array]:
    """Latitude rad and altitude m (m − 1,) in the middle of each step, where the system believes it is.

    5 mg too little on the vertical and it has climbed 22 m after 30 s, where gravity is 7e-6 g less.
    """
    moved = np.cumsum(v * dt[:, None], axis=0) - 0.5 * v * dt[:, None]
    altitude = record.altitude - moved[:, 2]
    meridian, _ = earth.principal_radii(record.latitude)
    return record.latitude + moved[:, 0] / (meridian + altitude), altitude


def references(record: NavigationRecord) -> tuple[Array, Array]:
    """Mean of the true inertial rate (3,) rad/s and specific force (3,) m/s² in body axes over the record.

    ω = w + C̄ᵀ ω_ie,  f = −C̄ᵀ g or what the bench sets;  C̄ᵀ = J(−w T) C₀ᵀ, w over the ground, T its length
    """
    length = record.time_s[-1] - record.time_s[0]
    mean = mean_turn(-record.table_rate * length) @ direction_cosines(record.attitude[:1])[0].T
    rate = record.table_rate + mean @ earth.earth_rate_ned(record.latitude)
    if record.table_force is not None:
        return rate, record.table_force
    return rate, -mean @ earth.gravity_ned(record.latitude, record.altitude)


def direction_cosines(attitude: Array) -> Array:
    """C_nb (m, 3, 3) of roll, pitch, heading (m, 3) rad."""
    roll, pitch, heading = (
        quaternion.from_rotation_vector(np.eye(3)[:, [i]] * attitude[:, i]) for i in range(3)
    )
    return quaternion.to_matrix(quaternion.product(quaternion.product(heading, pitch), roll))


def mean_turn(angle: Array) -> Array:
    """J(φ) = ∫₀¹ exp(s φ×) ds = I + (1 − cos φ)/φ² [φ×] + (φ − sin φ)/φ³ [φ×]², (..., 3) -> (..., 3, 3)."""
    size = np.linalg.norm(angle, axis=-1)[..., None, None]
    safe = np.where(size < 1e-4, 1.0, size)
    first = np.where(size < 1e-4, 0.5 - size**2 / 24.0, (1.0 - np.cos(safe)) / safe**2)
    second = np.where(size < 1e-4, 1.0 / 6.0 - size**2 / 120.0, (safe - np.sin(safe)) / safe**3)
    turned = skew(angle)
    return np.asarray(np.eye(3) + first * turned + second * turned @ turned)


def _turn(angle: Array) -> Array:
    """exp(φ×) (m, 3, 3) of rotation vectors (m, 3)."""
    return quaternion.to_matrix(quaternion.from_rotation_vector(angle.T))


def _refuse_fast(record: NavigationRecord, angle: Array, dt: Array) -> None:
    asked = float(np.linalg.norm(record.table_rate)) * float(dt.max())
    seen = float(np.linalg.norm(angle, axis=1).max())
    if max(asked, seen) > _MOST_TURN:
        raise InputError(
            f"record {record.name or record.lines[0]} turns {np.degrees(max(asked, seen)):.0f} deg between "
            f"two samples; log at {1.5 * max(asked, seen) / _MOST_TURN / float(dt.max()):.0f} Hz or more"
        )


def _slope(time: Array, values: Array) -> float:
    """Of a straight line through the values, per second."""
    return float(np.polyfit(time - time.mean(), values, 1)[0]) if np.ptp(values) > 0 else 0.0


def _notes(records: Sequence[NavigationRecord]) -> list[str]:
    loaded = sum(r.table_force is not None for r in records)
    turning = sum(r.table_force is None and bool(np.any(r.table_rate != 0)) for r in records)
    still = len(records) - turning - loaded
    return [
        f"sensors' readings from navigation outputs: {still} records at rest, {turning} turning, {loaded} "
        "under load; the attitude of each record's first sample is taken for the bench's own"
    ]
