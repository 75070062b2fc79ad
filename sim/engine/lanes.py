"""Numbers that lie side by side in vectors, and the machine code that computes with them.

Owns the arithmetic in which the laws and the step of the engine are written: an
expression of `Lanes` computes nothing, it emits the instructions that will. What
is emitted does as it says, to the last bit: a product that something is added to
becomes one fused multiply-add, nothing is re-ordered, and NaN stays NaN. So a
lane's result depends on neither its neighbours nor how many there are. It knows
no loops, no memory and nothing of servos.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from functools import reduce
from typing import Any

from llvmlite import ir

from sim.engine.machine_code import has_wide_vectors

__all__ = ["Code", "Lanes", "Number", "Product"]

_TINY_IS_ZERO = {"x86": 0x8040, "arm": 1 << 24}
"""Bits of a processor's control word that take numbers too small for all their digits for zero."""

VECTOR_BYTES = 64 if has_wide_vectors() else 32
"""Of the vectors that programs are written in; those of a machine may be narrower still."""


class Code:
    """Where instructions go, and the kind of number that they compute with.

    Parameters
    ----------
    module
        The module that the instructions will belong to.
    builder
        Appends instructions.
    single
        Single precision, and twice as many numbers in a vector.
    fused
        Whether the machine multiplies and adds in one; where it cannot, both are rounded.
    branches
        Whether `short_cut` takes the shorter way.
    """

    def __init__(
        self,
        module: ir.Module,
        builder: ir.IRBuilder,
        single: bool,
        fused: bool,
        branches: bool = False,
    ) -> None:
        self.builder, self._module = builder, module
        self.branches = branches
        self.scalar = ir.FloatType() if single else ir.DoubleType()
        self.bytes = 4 if single else 8
        self.width = VECTOR_BYTES // self.bytes
        self.vector = ir.VectorType(self.scalar, self.width)
        kind = f"v{self.width}f{8 * self.bytes}"
        three, one = [self.vector] * 3, [self.vector]
        self._fma = ir.Function(module, ir.FunctionType(self.vector, three), f"llvm.fma.{kind}")
        self._fabs = ir.Function(module, ir.FunctionType(self.vector, one), f"llvm.fabs.{kind}")
        kind_of_two = ir.FunctionType(self.vector, [self.vector] * 2)
        self._floor = ir.Function(module, ir.FunctionType(self.vector, one), f"llvm.floor.{kind}")
        self._copysign = ir.Function(module, kind_of_two, f"llvm.copysign.{kind}")
        self._fused = fused

    def multiply_add(self, a: Any, b: Any, c: Any) -> Any:
        """One vector a b + c."""
        if self._fused:
            return self.builder.call(self._fma, [a, b, c])
        return self.builder.fadd(self.builder.fmul(a, b), c)

    def magnitude(self, a: Any) -> Any:
        """One vector |a|."""
        return self.builder.call(self._fabs, [a])

    def floor(self, a: Any) -> Any:
        """One vector of the largest whole numbers that are not above a."""
        return self.builder.call(self._floor, [a])

    def signed_as(self, a: Any, b: Any) -> Any:
        """One vector |a| with the signs of b."""
        return self.builder.call(self._copysign, [a, b])

    def signed_by(self, a: Any, b: Any) -> Any:
        """One vector a with its signs turned where b has a minus sign."""
        emit, bits = self.builder, ir.VectorType(ir.IntType(8 * self.bytes), self.width)
        minus = ir.Constant(bits, [1 << (8 * self.bytes - 1)] * self.width)
        sign = emit.and_(emit.bitcast(b, bits), minus)
        return emit.bitcast(emit.xor(emit.bitcast(a, bits), sign), self.vector)

    def everywhere(self, scalar: Any) -> Any:
        """A vector that holds one number throughout."""
        blank = ir.Constant(self.vector, ir.Undefined)
        one = self.builder.insert_element(blank, scalar, ir.IntType(32)(0))
        first = ir.Constant(ir.VectorType(ir.IntType(32), self.width), [0] * self.width)
        return self.builder.shuffle_vector(one, blank, first)

    @contextmanager
    def without_denormals(self, architecture: str) -> Iterator[None]:
        """Numbers too small for all their digits are zero in loops that are emitted inside.

        A mode that dies away and is never pushed, as an amplifier's lag, would end among them, and
        a step then takes four times as long. On an `architecture` not known here it does.
        """
        if architecture not in _TINY_IS_ZERO:
            yield
            return
        ask, tell = self._x86_control() if architecture == "x86" else self._arm_control()
        before = ask()
        tell(self.builder.or_(before, before.type(_TINY_IS_ZERO[architecture])))
        yield
        tell(before)

    def _x86_control(self) -> tuple[Callable[[], Any], Callable[[Any], Any]]:
        """What reads the control word and what sets it; here both go by way of memory."""
        emit, pointer, word = self.builder, ir.IntType(8).as_pointer(), ir.IntType(32)
        kind = ir.FunctionType(ir.VoidType(), [pointer])
        read, write = (
            ir.Function(self._module, kind, f"llvm.x86.sse.{k}mxcsr") for k in ("st", "ld")
        )
        place = emit.alloca(word)
        way = emit.bitcast(place, pointer)

        def ask() -> Any:
            emit.call(read, [way])
            return emit.load(place)

        def tell(control: Any) -> None:
            emit.store(control, place)
            emit.call(write, [way])

        return ask, tell

    def _arm_control(self) -> tuple[Callable[[], Any], Callable[[Any], Any]]:
        """The same, where the word comes and goes in a register."""
        word = ir.IntType(64)
        read = ir.Function(self._module, ir.FunctionType(word, []), "llvm.aarch64.get.fpcr")
        kind = ir.FunctionType(ir.VoidType(), [word])
        write = ir.Function(self._module, kind, "llvm.aarch64.set.fpcr")
        return lambda: self.builder.call(read, []), lambda it: self.builder.call(write, [it])

    def short_cut(
        self, short: Callable[[], tuple[Choice, Lanes]], full: Callable[[], Lanes]
    ) -> Lanes:
        """What `full` gives, by a shorter way where all lanes may take it.

        `short` gives where it is as good as `full`, to the last bit, and its numbers. Only a
        program that branches takes it: the processor predicts it and goes on meanwhile. Where many
        lanes are stepped one of them always needs `full`.
        """
        if not self.branches:
            return full()
        emit, bits = self.builder, ir.IntType(self.width)
        good, quick = short()
        every = reduce(emit.and_, good.vectors)
        needed = emit.icmp_unsigned("!=", emit.bitcast(every, bits), bits((1 << self.width) - 1))
        before = emit.block
        with emit.if_then(needed, likely=False):
            slow = full()
            after = emit.block
        found = []
        for one, two in zip(quick.vectors, slow.vectors, strict=True):
            chosen = emit.phi(self.vector)
            chosen.add_incoming(one, before)
            chosen.add_incoming(two, after)
            found.append(chosen)
        return Lanes(self, found)

    def constant(self, value: float, count: int) -> Lanes:
        """The same number in all lanes of so many vectors."""
        one = ir.Constant(self.vector, [ir.Constant(self.scalar, value)] * self.width)
        return Lanes(self, [one] * count)

    def lanes(self, number: Number, count: int) -> Lanes:
        """A number, whatever it is, as lanes of so many vectors."""
        if isinstance(number, (Lanes, Product)):
            return number.lanes()
        return self.constant(float(number), count)


class Lanes:
    """A number in every lane of some vectors."""

    __slots__ = ("code", "vectors")

    def __init__(self, code: Code, vectors: Iterable[Any]) -> None:
        self.code, self.vectors = code, tuple(vectors)

    def lanes(self) -> Lanes:
        """Itself; of a `Product`, its rounded value."""
        return self

    def like(self, other: Number) -> Lanes:
        """Another number in as many lanes."""
        return self.code.lanes(other, len(self.vectors))

    def __add__(self, other: Number) -> Lanes:
        if isinstance(other, Product):
            return other.plus(self)
        return self._each("fadd", self.like(other))

    __radd__ = __add__

    def __sub__(self, other: Number) -> Lanes:
        if isinstance(other, Product):
            return (-other).plus(self)
        return self._each("fsub", self.like(other))

    def __rsub__(self, other: float) -> Lanes:
        return self.like(other) - self

    def __mul__(self, other: Number) -> Product:
        return Product(self, self.like(other))

    __rmul__ = __mul__

    def __truediv__(self, other: Number) -> Lanes:
        return self._each("fdiv", self.like(other))

    def __rtruediv__(self, other: float) -> Lanes:
        return self.like(other) / self

    def __neg__(self) -> Lanes:
        return Lanes(self.code, [self.code.builder.fneg(one) for one in self.vectors])

    def __abs__(self) -> Lanes:
        return Lanes(self.code, [self.code.magnitude(one) for one in self.vectors])

    def floor(self) -> Lanes:
        """The largest whole number that is not above it."""
        return Lanes(self.code, [self.code.floor(one) for one in self.vectors])

    def __lt__(self, other: Number) -> Choice:
        return self._compare("<", other)

    def __le__(self, other: Number) -> Choice:
        return self._compare("<=", other)

    def __gt__(self, other: Number) -> Choice:
        return self._compare(">", other)

    def __ge__(self, other: Number) -> Choice:
        return self._compare(">=", other)

    def is_zero(self) -> Choice:
        """Where it is zero."""
        return self._compare("==", 0.0)

    def equals(self, other: Number) -> Choice:
        """Where it is another number to the last bit."""
        return self._compare("==", other)

    def signed_as(self, other: Lanes) -> Lanes:
        """Its magnitude with the sign of another; a sign is a bit, and zero has one."""
        pairs = zip(self.vectors, other.vectors, strict=True)
        return Lanes(self.code, [self.code.signed_as(one, two) for one, two in pairs])

    def signed_by(self, other: Lanes) -> Lanes:
        """Itself where another has no minus sign, and its negative where that has one."""
        pairs = zip(self.vectors, other.vectors, strict=True)
        return Lanes(self.code, [self.code.signed_by(one, two) for one, two in pairs])

    def _compare(self, how: str, other: Number) -> Choice:
        emit = self.code.builder.fcmp_ordered
        pairs = zip(self.vectors, self.like(other).vectors, strict=True)
        return Choice(self.code, [emit(how, one, two) for one, two in pairs])

    def _each(self, instruction: str, other: Lanes) -> Lanes:
        emit = getattr(self.code.builder, instruction)
        pairs = zip(self.vectors, other.vectors, strict=True)
        return Lanes(self.code, [emit(one, two) for one, two in pairs])


class Product:
    """A product that is fused with what is added to it, or else rounded where it is used."""

    __slots__ = ("factor", "other")

    def __init__(self, factor: Lanes, other: Lanes) -> None:
        self.factor, self.other = factor, other

    def lanes(self) -> Lanes:
        """Its rounded value."""
        return self.factor._each("fmul", self.other)

    def plus(self, term: Lanes) -> Lanes:
        """The product and a term, rounded once."""
        code = self.factor.code
        all_three = zip(self.factor.vectors, self.other.vectors, term.vectors, strict=True)
        return Lanes(code, [code.multiply_add(*three) for three in all_three])

    def __add__(self, other: Number) -> Lanes:
        return self.plus(self.factor.like(other))

    __radd__ = __add__

    def __sub__(self, other: Number) -> Lanes:
        negative = -other if isinstance(other, (int, float)) else -other.lanes()
        return self.plus(self.factor.like(negative))

    def __rsub__(self, other: float) -> Lanes:
        return (-self).plus(self.factor.like(other))

    def __mul__(self, other: Number) -> Product:
        return self.lanes() * other

    __rmul__ = __mul__

    def __truediv__(self, other: Number) -> Lanes:
        return self.lanes() / other

    def __neg__(self) -> Product:
        return Product(-self.factor, self.other)

    def __abs__(self) -> Lanes:
        return abs(self.lanes())


class Choice:
    """A yes or no in every lane."""

    __slots__ = ("code", "vectors")

    def __init__(self, code: Code, vectors: Sequence[Any]) -> None:
        self.code, self.vectors = code, tuple(vectors)

    def __and__(self, other: Choice) -> Choice:
        pairs = zip(self.vectors, other.vectors, strict=True)
        return Choice(self.code, [self.code.builder.and_(one, two) for one, two in pairs])

    def __or__(self, other: Choice) -> Choice:
        pairs = zip(self.vectors, other.vectors, strict=True)
        return Choice(self.code, [self.code.builder.or_(one, two) for one, two in pairs])

    def __invert__(self) -> Choice:
        return Choice(self.code, [self.code.builder.not_(one) for one in self.vectors])

    def choose(self, yes: Number, no: Number) -> Lanes:
        """One number where it is yes, and another where it is no."""
        emit, count = self.code.builder.select, len(self.vectors)
        one, other = self.code.lanes(yes, count), self.code.lanes(no, count)
        three = zip(self.vectors, one.vectors, other.vectors, strict=True)
        return Lanes(self.code, [emit(*each) for each in three])


Number = Lanes | Product | float


def least(one: Lanes, other: Number) -> Lanes:
    """The smaller of two numbers."""
    second = one.like(other)
    return (one < second).choose(one, second)


def greatest(one: Lanes, other: Number) -> Lanes:
    """The larger of two numbers."""
    second = one.like(other)
    return (one > second).choose(one, second)


def between(one: Lanes | Product, low: Lanes, high: Lanes) -> Lanes:
    """The number, or the limit that it is beyond."""
    return least(greatest(one.lanes(), low), high)
