"""Driving the bench application without a terminal, and reading its screens as plain text."""

import asyncio
import time
from contextlib import asynccontextmanager, suppress

from textual.pilot import WaitForScreenTimeout

from daq.store import Store
from tui.app.application import BenchApp
from tui.app.messages import InstrumentsListed
from tui.app.state.analyses import Analyses
from tui.measure_options import PlanOptions

SIZES = [(80, 24), (120, 40), (200, 60)]

LONG = {"points": "2800", "cycles": ("4", "4")}
"""A sweep that is still under way when keys are pressed."""

ESTIMATE = {
    "unit": "ADSS",
    "contribution_ratio": {"value": 0.31, "std": 0.05, "interval95": [0.22, 0.41]},
    "b1_deg": {"value": 0.2148, "std": 0.0347},
    "b2_deg": {"value": 0.0455, "std": 0.0033},
    "b_t_deg": {"value": 0.066, "std": 0.0},
    "error_index": {
        "ratio": [0.0, 0.25, 0.5, 0.75, 1.0],
        "hz": [12.0, 3.0, 5.0, 9.0, 14.0],
        "std_hz": [1.0, 1.0, 1.0, None, 1.0],
        "minimum_ratio": 0.25,
    },
    "warnings": [],
}
"""What a quick estimate says, in the form of ``estimate --json``."""

DIAGNOSIS = {
    "verdict": "ambiguous",
    "causes": [
        {
            "effect": "load-inertia",
            "parameters": {"J_L": {"value": 0.0031, "std": 0.0001, "unit": "kg.m^2"}},
            "probability": 0.55,
        }
    ],
    "rivals": [{"causes": ["shaft-stiffness"], "probability": 0.41,
                "remark": "needs a size outside its plausible range"}],
    "baseline": {"held_out_rms_sigma": 4.2, "held_out_rms_db": 1.9},
    "extended": {"held_out_rms_sigma": 1.1, "held_out_rms_db": 0.4},
    "gain": {"held_out_rms_ratio": 0.26},
    "contribution_ratio": {
        "baseline": {"value": 0.42, "std": 0.05},
        "extended": {"value": 0.31, "std": 0.04},
    },
    "b1_deg": None,
    "b2_deg": None,
    "b_t_deg": None,
    "models": [
        {"causes": ["load-inertia"], "probability": 0.55,
         "contribution_ratio": {"value": 0.31, "std": 0.04, "interval95": [0.23, 0.39]},
         "b1_deg": {"value": 0.2148, "std": 0.028}, "b2_deg": {"value": 0.0455, "std": 0.0026},
         "b_t_deg": {"value": 0.066, "std": 0.0}},
        {"causes": ["shaft-stiffness"], "probability": 0.41,
         "contribution_ratio": {"value": 0.62, "std": 0.04, "interval95": [0.54, 0.7]},
         "b1_deg": {"value": 0.4297, "std": 0.028}, "b2_deg": {"value": 0.0251, "std": 0.0026},
         "b_t_deg": {"value": 0.066, "std": 0.0}},
    ],
    "residual": [],
    "next_measurement": {
        "plan": {"levels_vpk": [2.0], "frequencies_hz": [120.0, 130.0, 140.0],
                 "settle_cycles": 4, "integrate_cycles": 4},
        "separates": ["load-inertia", "shaft-stiffness"],
        "expected_sigma": 5.0,
    },
    "elapsed_s": 1.0,
}  # fmt: skip
"""What a quick diagnosis says, in the form of ``diagnose --json``."""


class Diagnosed:
    """A diagnosis as the analysis gives it."""

    def __init__(self, document=DIAGNOSIS):
        self._document = document

    def to_json(self):
        return self._document

    def summary(self):
        return ["ambiguous"]


def quick_analyses(**instead) -> Analyses:
    """Analyses that know their answer."""

    def estimate(response, unit, progress):
        progress(0.5, "looking it up")
        return ESTIMATE

    def diagnose(responses, unit, progress):
        progress(0.5, "looking it up")
        return Diagnosed()

    def report(task, diagnosis, path):
        path.write_text(f"<html>measurement {task.measurement}</html>")

    known = {"estimate": estimate, "diagnose": diagnose, "report": report}
    return Analyses(**(known | instead))


def nothing_found(post):
    post(InstrumentsListed([], []))


def text_of(app) -> str:
    """The screen as it is seen, one line per row."""
    # A private name of the framework; it is used here and nowhere else.
    return "\n".join(strip.text.rstrip() for strip in app.screen._compositor.render_strips())


class Operator:
    """Presses keys and waits until something stands on the screen."""

    def __init__(self, app, pilot):
        self.app, self.pilot = app, pilot

    @property
    def screen(self) -> str:
        return text_of(self.app)

    async def press(self, *keys):
        await self.pilot.press(*keys)

    async def sees(self, *words, within_s=20.0) -> str:
        """The screen, once all words stand on it."""
        end, wait_s = time.monotonic() + within_s, 0.03
        while True:
            screen = self.screen
            if all(word in screen for word in words):
                return screen
            assert time.monotonic() < end, f"{words} not on the screen:\n{screen}"
            # A machine that is busy with other things is no fault of the screen.
            with suppress(WaitForScreenTimeout):
                await self.pilot.pause(wait_s)
            # Each look draws all of the screen: what takes long is looked for less often.
            wait_s = min(1.3 * wait_s, 0.3)

    async def types(self, selector, text):
        field = self.app.screen.query_one(selector)
        field.focus()
        field.value = text
        await self.pilot.pause()

    async def goes_to(self, step):
        """Step by step, as the keys for it work while a field has the focus."""
        for _ in range(40):
            if step == self.app.screen.STEP:
                break
            # The first Escape leaves a field, the next one the step.
            await self.press("ctrl+n" if step > self.app.screen.STEP else "escape")
        await self.sees(f"[{step} ")

    async def connects(self, url):
        await self.goes_to(2)
        await self.types("#url", url)
        await self.press("enter")
        return await self.sees("CONNECTED to")

    async def plans(self, levels="2.5", start="115", stop="160", points="16", cycles=("6", "6")):
        """Set the plan in step 3."""
        await self.goes_to(3)
        await self.press("p")
        await self.sees("The sweep")
        values = {"levels": levels, "start": start, "stop": stop, "points": points}
        values |= {"settle": cycles[0], "integrate": cycles[1]}
        for name, value in values.items():
            self.app.screen.query_one(f"#plan-{name}").value = value
        await self.press("enter")
        await self.sees("[3 Check]", f"from {start} to {stop} Hz")

    async def checks(self):
        """Run the checks; a wire that might be hardware asks first."""
        await self.press("c")
        if "Drive the unit?" in self.screen:
            await self.press("y")
        return await self.sees("all passed")


@asynccontextmanager
async def operated(db, size=(80, 24), **options):
    """An application in a terminal of some size."""
    settings = {"analyses": quick_analyses(), "find": nothing_found} | options
    app = BenchApp(db, **settings)
    async with app.run_test(size=size, notifications=True) as pilot:
        await pilot.pause()
        operator = Operator(app, pilot)
        try:
            yield operator
        finally:
            # A test that failed must not leave a session behind.
            app.keeper.stop_now()
            await asyncio.wait_for(app.workers.wait_for_complete(), 60.0)


def run(test):
    """Run a coroutine function that takes nothing."""
    asyncio.run(test())


def begun(db):
    with Store(db, read_only=True) as store:
        return [m for m in store.measurements() if m.points][-1]


async def starts(op, url, points="16", cycles=("6", "6")):
    """Start a sweep without the steps before it, each of which `test_app_way.py` takes."""
    while op.app.desk.unit is None:
        await op.pilot.pause(0.05)
    op.app.desk.url = url
    op.app.desk.options = PlanOptions(
        (2.5,), 115.0, 160.0, int(points), None, None, *map(int, cycles)
    )
    assert op.app.keeper.start(hold=False)
    await op.press("4")


async def sweeping(op, url, **plan):
    """Start a sweep and wait until it has a few points."""
    await starts(op, url, **plan)
    await some_points(op)


async def some_points(op, count=3):
    end = time.monotonic() + 20
    while op.app.desk.run.done < count:
        assert time.monotonic() < end, op.screen
        await op.pilot.pause(0.01)
