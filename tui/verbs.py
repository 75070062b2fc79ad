"""The verbs of the command line, and the page that lists them.

Owns what can be said without the parser, whose import takes most of the time of `--help`. It
imports no verb and nothing that takes time.
"""

from __future__ import annotations

from textwrap import wrap

__all__ = ["EPILOGUE", "FRONT_PAGES", "SUMMARY", "VERBS", "front_page"]

VERBS = {
    "simulate": ("tui.commands.simulate:simulate", "Simulate a sweep and write the response."),
    "extract": (
        "tui.commands.files.extract:extract",
        "Read ARF, RF and damping out of a response.",
    ),
    "estimate": ("tui.commands.estimate:estimate", "Tell the backlash of each gear stage."),
    "diagnose": ("tui.commands.diagnose:diagnose", "Tell what the simulation gets wrong, and why."),
    "plan": ("tui.commands.plan:plan", "Choose the sweep that tells most of a unit."),
    "commission": (
        "tui.commands.commission:commission",
        "Learn a good drive's parameters; write its unit file.",
    ),
    "reproduce": ("tui.commands.reproduce:reproduce", "Compute the paper's tables and figures."),
    "measure": ("tui.commands.measure:measure", "Measure a unit on the bench."),
    "line": ("tui.commands.line:line", "Measure and judge unit after unit, by serial number."),
    "prepare": ("tui.commands.prepare:prepare", "Train a posterior, or simulate a sweep ahead."),
    "history": (
        "tui.commands.stored.history:history",
        "List a bench's measurements and their trend.",
    ),
    "correct": ("tui.commands.stored.correct:correct", "Correct what was said of a measurement."),
    "export": ("tui.commands.files.export:export", "Write a stored measurement to a file."),
    "convert": ("tui.commands.files.convert:convert", "Write a response in another file format."),
    "frf": ("tui.commands.files.frf:frf", "Estimate a response from a record over time."),
    "plot": ("tui.commands.files.plot:plot", "Draw responses, with the model beside them."),
    "report": (
        "tui.commands.stored.report:report",
        "Write a report or certificate, as HTML or PDF.",
    ),
    "index": (
        "tui.commands.stored.index:index",
        "Write a page that lists a history and its reports.",
    ),
    "new-unit": ("tui.commands.new_unit:new_unit", "Write a unit file to fill in, or check one."),
    "serve": ("tui.commands.serve:serve", "Serve a simulated instrument."),
    "demo": ("tui.commands.demo:demo", "Do the whole job without hardware."),
    "bench": ("tui.commands.bench:bench", "Open the bench screen; so does no verb at all."),
    "replay": ("tui.commands.stored.replay:replay", "Show a recorded session as it ran."),
    "doctor": ("tui.commands.doctor:doctor", "Check this installation; say what to mend."),
    "first-day": ("tui.commands.first_day:first_day", "Check a real instrument on its first day."),
    "completion": ("tui.commands.completion:completion", "Print completions for a shell."),
}
"""Every verb: the function that does it, and its line in the help."""

SUMMARY = "Bench application for geared servos: how much backlash sits in each gear stage."
EPILOGUE = (
    "Every command also takes --quiet (no narration), --debug (trace of an error), "
    "--log-level debug|info|warning|error (write the log file) and --trust-effects (execute the "
    "Python files of effects that a unit file names)."
)

FRONT_PAGES = (["--help"], ["-h"], ["--version"])
"""Words that ask for nothing but a page of the program itself."""


def front_page(words: list[str]) -> str:
    """The version where that is asked for, or the list of verbs, with an end of line."""
    if words == ["--version"]:
        from importlib.metadata import version

        return f"{version('lashbench')}\n"
    rows = [(name, summary) for name, (_, summary) in sorted(VERBS.items())]
    rows += [("--help (-h)", "Display this message and exit.")]
    rows += [("--version", "Display application version.")]
    width = max(len(name) for name, _ in rows)
    lines = [f"  {name:{width}}  {summary}" for name, summary in rows]
    page = ["Usage: lashbench COMMAND", "", SUMMARY, "", "Commands:", *lines, ""]
    return "\n".join([*page, *wrap(EPILOGUE, 80), ""])
