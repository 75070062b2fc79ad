"""The scalar laws of the engine, each solved over one step.

Owns what force a play, a friction, a clip or a hardening spring exerts over a
step. It knows neither what they are part of nor in which order they are solved.

A law sees y at the start of the step (`y0`) and would see `ahead` at its end if
it did not act; with its own force p, held over the step, it sees
y1 = ahead + beta p. A force that comes from a potential W (play, a hardening
spring) takes its mean along the step, p = (W(y1) - W(y0)) / (y1 - y0). Held
over the step it does the work W(y1) - W(y0) whatever the motion inside the
step was: no energy appears or vanishes, at any step.
"""

from __future__ import annotations

from dataclasses import dataclass

from sim.engine.lanes import Choice, Lanes, Number, between, greatest, least

__all__ = [
    "PlayOverStep",
    "Sampler",
    "cubic_force",
    "cubic_pair",
    "excess_force",
    "friction_force",
    "peaked_friction",
    "play_force",
    "transmitted",
]

_CORRECTIONS = 2
"""How often a play's share of the step is corrected; each leaves about 3 % of the error."""

_TINY = 1e-30
"""Stands for zero in what is divided by."""


@dataclass(frozen=True, slots=True)
class PlayOverStep:
    """What a play does over a step of one length h, in its stiffness k, its damping c and its beta.

    `half_k`, `per_step`: k/2 and c/h. With half = k beta / 2 and damp = (c/h) beta: `within` is
    half - damp, `outside` half + damp, `beyond` one less, and `inverse` its inverse with the
    other sign.
    """

    half_k: Lanes
    per_step: Lanes
    half: Lanes
    within: Lanes
    outside: Lanes
    beyond: Lanes
    inverse: Lanes


def play_force(y0: Lanes, ahead: Lanes, d: Lanes, low: Lanes, play: PlayOverStep) -> Lanes:
    """Mean of k clip(y, -d, d) over the step, and the damper c taken out while inside the play.

    With e = y - clip(y) the mean of clip is (clip0 + clip1)/2 + q (e0 + e1)/2, where q is
    the share of the step spent inside; q depends on y1, weakly. `low` is -d.
    """
    c0 = between(y0, low, d)
    e0 = y0 - c0
    known = play.within * c0 + ahead
    direct = (known * play.inverse).lanes()
    guess = e0.is_zero().choose(direct, play.outside * c0 + known)

    def force(c1: Lanes, twice: Number) -> Lanes:
        return play.per_step * (c1 - c0) + (play.half_k * twice).lanes()

    def staying() -> tuple[Choice, Lanes]:
        """Inside, or beyond one end, for the whole step."""
        c1, free = between(direct, low, d), e0.is_zero()
        closed = c1.equals(c0) & between(guess, low, d).equals(c0)
        return (free & c1.equals(direct)) | (closed & ~free), force(c1, c0 + c1)

    def crossing() -> Lanes:
        moved = guess - y0
        per_moved = 1.0 / moved.is_zero().choose(1.0, moved)
        q = ((between(guess, low, d) - c0) * per_moved).lanes()
        c1, e1 = c0, e0
        for _ in range(_CORRECTIONS):
            share = (play.half * q).lanes()
            pulled = share * e0 + known
            inside = (pulled * play.inverse).lanes()
            c1 = between(inside, low, d)
            # (1 - share) e1 = pulled + ..., by the series of 1/(1 - share): share is at most 0.1.
            series = share * (share * (share + 1.0) + 1.0) + 1.0
            outside = (play.beyond * c1 + pulled) * series
            e1 = c1.equals(inside).choose(0.0, outside)
            # One Newton step carries the reciprocal over to the corrected motion.
            moved = c1 + e1 - y0
            per_moved = (per_moved * (2.0 - moved * per_moved)).lanes()
            q = least(greatest(((c1 - c0) * per_moved).lanes(), 0.0), 1.0)
        return force(c1, q * (e0 + e1) + (c0 + c1))

    return y0.code.short_cut(staying, crossing)


def friction_force(w0: Lanes, ahead: Lanes, most: Lanes, holds: Lanes, per_beta: Lanes) -> Lanes:
    """Force that opposes the motion w with `most`, stops it dead, or turns with it.

    Where w passes zero inside the step, either what drives it is below
    break-away and it stops there, or friction turns at the crossing and the
    force is its mean. `holds` is beta times `most`, `per_beta` is -1/beta.
    """
    start = w0.is_zero().choose(ahead, w0)
    sliding = most.signed_as(-start)
    slid = ahead.signed_by(start) - holds
    slides = slid >= 0.0
    stops = abs(ahead - w0) <= holds

    def not_turning() -> tuple[Choice, Lanes]:
        return slides | stops, slides.choose(sliding, ahead * per_beta)

    def any_way() -> Lanes:
        before = abs(w0)
        share = before / (before - least(slid, -_TINY))
        turned = sliding * (2.0 * share - 1.0)
        return slides.choose(sliding, stops.choose(ahead * per_beta, turned))

    return w0.code.short_cut(not_turning, any_way)


def transmitted(y0: Lanes, y1: Lanes, force: Lanes, half_k: Lanes, per_step: Lanes) -> Lanes:
    """Mean torque in the mesh of a play over the step; `force` is that of the play."""
    closed = half_k * (y0 + y1) + (per_step * (y1 - y0)).lanes()
    return closed - force


def peaked_friction(w: Lanes, T: Lanes, T_s: Lanes, w_s: Lanes) -> Lanes:
    """Stribeck's curve T + T_s exp(-(w/w_s)^2), to 1e-5 of its peak."""
    u = w / w_s
    x = (least((u * u).lanes(), 40.0) * (1.0 / 64.0)).lanes()
    # exp(-64 x) as the 64th power of a Taylor series.
    power = 1.0 - x * (1.0 - x * (0.5 - x * (1.0 / 6.0 - x * (1.0 / 24.0 - x * (1.0 / 120.0)))))
    for _ in range(6):
        power = (power * power).lanes()
    return T_s * power + T


def excess_force(y0: Lanes, y1: Lanes, limit: Lanes) -> Lanes:
    """Mean of clip(y, -limit, limit) - y over the step; y itself does not feel it."""
    c0, c1 = between(y0, -limit, limit), between(y1, -limit, limit)
    moved = y1 - y0
    q = (c1 - c0) / moved.is_zero().choose(1.0, moved)
    return ((1.0 - q) * (y0 - c0 + y1 - c1) * -0.5).lanes()


@dataclass(frozen=True, slots=True)
class Sampler:
    """A law that a clock samples: where it stands before a step, and its numbers.

    `phase` of the clock, which ticks at 1; `offset` of the counts; `last` count; `value` that is
    held. `advance`: of the phase in a step. `per_count`: counts per unit of y, `scale`: value per
    count, neither used by one that does not count. `differs`: the value is that of the change.
    """

    counts: bool
    differs: bool
    phase: Lanes
    offset: Lanes
    last: Lanes
    value: Lanes
    advance: Lanes
    per_count: Lanes
    scale: Lanes

    def force(self, y0: Lanes, y1: Lanes) -> Lanes:
        """Mean of the held value over the step, in which y goes from y0 to y1."""
        ticks, share = self._tick()
        _, new = self._sampled(y0, y1, share)
        return ticks.choose((1.0 - share) * (new - self.value) + self.value, self.value)

    def after(self, y0: Lanes, y1: Lanes) -> tuple[Lanes, Lanes, Lanes]:
        """Phase, last count and value after the step."""
        ticks, share = self._tick()
        count, new = self._sampled(y0, y1, share)
        turned = self.phase + self.advance
        return (
            ticks.choose(turned - 1.0, turned),
            ticks.choose(count, self.last),
            ticks.choose(new, self.value),
        )

    def _tick(self) -> tuple[Choice, Lanes]:
        """Whether the clock ticks, and after which share of the step."""
        return self.phase + self.advance >= 1.0, (1.0 - self.phase) / self.advance

    def _sampled(self, y0: Lanes, y1: Lanes, share: Lanes) -> tuple[Lanes, Lanes]:
        """Count and value at the tick."""
        y = share * (y1 - y0) + y0
        if not self.counts:
            return self.last, y
        count = (y * self.per_count + self.offset).floor()
        since = self.last if self.differs else self.offset - 0.5
        return count, ((count - since) * self.scale).lanes()


def cubic_mean(y0: Lanes, y1: Lanes, quarter: Lanes) -> Lanes:
    """Mean of -k y^3 over the step; `quarter` is k/4."""
    return (-quarter * (y0 * y0 + (y1 * y1).lanes()) * (y0 + y1)).lanes()


def cubic_slope(y0: Lanes, y1: Lanes, quarter: Lanes) -> Lanes:
    """How fast that mean falls with y1."""
    return (quarter * (y0 * y0 + (2.0 * y0 + 3.0 * y1) * y1)).lanes()


def cubic_force(y0: Lanes, ahead: Lanes, last: Lanes, k: Lanes, beta: Lanes) -> Lanes:
    """Mean of -k y^3 over the step, by two Newton steps from the last force."""
    quarter = (0.25 * k).lanes()
    y1 = beta * last + ahead
    for _ in range(2):
        miss = y1 - ahead - beta * cubic_mean(y0, y1, quarter)
        y1 = y1 - miss / (beta * cubic_slope(y0, y1, quarter) + 1.0)
    return cubic_mean(y0, y1, quarter)


@dataclass(frozen=True, slots=True)
class Coupling:
    """What two laws see of their own and each other's force."""

    yy: Lanes
    yz: Lanes
    zy: Lanes
    zz: Lanes


def cubic_pair(
    starts: tuple[Lanes, Lanes],
    aheads: tuple[Lanes, Lanes],
    last: tuple[Lanes, Lanes],
    stiffness: tuple[Lanes, Lanes],
    felt: Coupling,
) -> tuple[Lanes, Lanes]:
    """Forces of two hardening springs, by one Newton step for both from the last ones.

    In turn they would settle slowly: two halves of a shaft push the tiny inertia between
    them, and each nearly undoes what the other did.
    """
    (y0, z0), (y_ahead, z_ahead), (p, r) = starts, aheads, last
    k, n = ((0.25 * one).lanes() for one in stiffness)
    y = felt.yz * r + (felt.yy * p + y_ahead)
    z = felt.zz * r + (felt.zy * p + z_ahead)
    p, r = cubic_mean(y0, y, k), cubic_mean(z0, z, n)
    s, t = cubic_slope(y0, y, k), cubic_slope(z0, z, n)
    y_miss = y - y_ahead - felt.yy * p - felt.yz * r
    z_miss = z - z_ahead - felt.zy * p - felt.zz * r
    y_felt, z_felt = felt.yy * s + 1.0, felt.zz * t + 1.0
    across, back = (felt.yz * t).lanes(), (felt.zy * s).lanes()
    inverse = 1.0 / (y_felt * z_felt - across * back)
    y = y - (z_felt * y_miss - across * z_miss) * inverse
    z = z - (y_felt * z_miss - back * y_miss) * inverse
    return cubic_mean(y0, y, k), cubic_mean(z0, z, n)
