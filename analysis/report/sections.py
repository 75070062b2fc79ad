"""The sections of a report as HTML, from the document that it carries.

Owns their order and wording. It reads nothing but the document and the
figures handed to it, so that the page and its machine-readable copy agree.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from analysis.advice import Advice
from analysis.answer import Answer, model_name
from analysis.ensemble.datasheet_belief import believed_lines
from analysis.estimate.datasheet_posterior import datasheet_lines
from analysis.inference.exclusion import describe_unseen, head_unseen
from analysis.observation.joint import sweep_lines
from analysis.report.certificate import head_rows, issued
from analysis.report.html import Markup, element, joined, table
from analysis.resonance.records import with_error
from analysis.selection.wording import verdict_words

__all__ = [
    "backlash_section",
    "diagnosis_section",
    "facts_section",
    "features_section",
    "provenance_section",
    "summary_section",
]

Data = Mapping[str, Any]

_SITES = {"plant": "in the mechanics", "chain": "in the measuring chain"}
_MOST_ROWS = 8
_MOST_TEXT = 600


def summary_section(data: Data, actions: Sequence[str]) -> Markup:
    """The heading, what was found in one look, and what to do."""
    words = data["measurement"]
    serial = words.get("serial") or ""
    name = _short(f"{data['unit']['name']} {serial}".strip())
    parts = [
        element("h1", f"Backlash report: {name}"),
        element("p", " - ".join(issued(data)), class_="small"),
    ]
    if data["simulated"]:
        parts.append(
            element("p", "SIMULATED: these data are of no real machine.", class_="simulated")
        )
    parts.append(element("ul", [element("li", line) for line in actions], class_="actions"))
    return element("header", parts)


def facts_section(data: Data) -> Markup:
    """Unit, operator, instrument and conditions."""
    words, origin, how = data["measurement"], data["origin"], data["procedure"]
    instrument, columns = data["instrument"] or {}, data["response"]
    maker = " ".join(str(instrument.get(k) or "") for k in ("maker", "model")).strip()
    detail = [
        f"{label} {instrument[key]}"
        for key, label in (("serial", "serial"), ("revision", "revision"))
        if instrument.get(key)
    ]
    # A level that is not known sorts last and reads as such.
    levels = sorted({v for v in columns["source_vpk"] if v is not None})
    frequencies = [v for v in columns["frequency_hz"] if v is not None]
    sweep = f"{len(frequencies)} points"
    if frequencies:
        sweep += f", {min(frequencies):g} to {max(frequencies):g} Hz"
    sweep += f", {how['direction']}" if how["direction"] else ""
    rows = [
        ("Unit", data["unit"]["name"]),
        ("Serial number", words.get("serial")),
        ("Operator", words.get("operator")),
        ("Notes", words.get("notes") or words.get("note")),
        ("Data", origin["name"]),
        ("Begun", words.get("started")),
        ("Ended", origin.get("ended")),
        ("State", words.get("state")),
        ("Instrument", ", ".join(filter(None, [maker, *detail]))),
        *head_rows(data),
        ("Address", words.get("address")),
        ("Source at the end", origin.get("source_state")),
        ("Loop", data["unit"].get("loop")),
        ("Sweep", sweep),
        ("Source levels", ", ".join(f"{v:g}" for v in levels) + " V peak" if levels else None),
        ("DC offset", _with_unit(words.get("dc_offset_v"), "V")),
        ("Each point", _cycles(how)),
        ("Flagged points", origin.get("flagged", _flagged(columns))),
    ]
    shown = [(name, _short(str(value))) for name, value in rows if value not in (None, "")]
    return _section("Measurement", table(shown, row_heads=True, class_="facts"))


def features_section(data: Data, bode: Markup) -> Markup:
    """The Bode figure with what was read out of it."""
    rows: list[list[str]] = []
    flags: dict[str, list[str]] = {}
    for level in data["features"]["levels"]:
        volts = "?" if level["source_vpk"] is None else f"{level['source_vpk']:g}"
        cells = [volts]
        for name in ("arf", "rf"):
            feature, zeta = level[name] or {}, level["damping_ratio"][name] or {}
            cells += [
                with_error(feature.get("frequency_hz"), feature.get("std_hz")),
                with_error(feature.get("gain_db"), feature.get("gain_std_db")),
                with_error(zeta.get("value"), zeta.get("std")),
            ]
        difference = level["difference_hz"] or {}
        rows.append([*cells, with_error(difference.get("value"), difference.get("std"))])
        for flag in level["flags"]:
            flags.setdefault(flag, []).append(volts)
    head = ("V peak", "ARF / Hz", "gain / dB", "damping", "RF / Hz", "gain / dB", "damping",
            "RF - ARF / Hz")  # fmt: skip
    return _section(
        "Response",
        element("figure", bode, element("figcaption", "Gain and phase of V_o/V_i; bars are one "
                "standard error, bands the anti-resonance (ARF) and resonance (RF).")),
        table(rows, head, class_="figures"),
        _notes([f"{', '.join(at)} V, {flag}" for flag, at in flags.items()]),
    )  # fmt: skip


def backlash_section(data: Data, answer: Answer, advice: Advice, picture: Markup | None) -> Markup:
    """How much of the backlash sits in each stage, by the accepted model or those that are left."""
    estimate, diagnosis = data["estimate"], data["diagnosis"]
    parts = [element("p", _said_by(data, answer))]
    parts += [_backlash_table(model, len(answer.models) > 1) for model in answer.models]
    if answer.models:
        parts.append(_list([stage.line for stage in advice.stages]))
    if diagnosis is not None and estimate is not None and answer.models:
        parts.append(
            element(
                "p",
                "The estimate from the plain model is in the data alone: with a diagnosis, the "
                "ratio is learned anew from simulated machines of the models that are left.",
                class_="small",
            )
        )
    if picture is not None:
        caption = "Curve: the error index of ARF and RF by the plain model, the paper's measure."
        if answer.contribution_ratio is not None:
            bar = f"Dot and bar: contribution ratio with its 95 % interval, {answer.source}."
            caption = f"{bar} {caption}" if estimate and estimate.get("error_index") else bar
        parts.append(element("figure", picture, element("figcaption", caption)))
    if estimate is not None and diagnosis is None:
        parts.append(_list([*believed_lines(estimate), *datasheet_lines(estimate)]))
        parts.append(_notes(estimate.get("warnings", [])))
    return _section("Backlash", *parts)


def _said_by(data: Data, answer: Answer) -> str:
    """Which model the numbers are of, or why there are none."""
    if answer.state == "none":
        return str(_why(data, "estimate"))
    if answer.state == "open":
        return "No model is accepted yet. Each that is left tells its own backlash:"
    if answer.models:
        beside = "; then what is not ruled out beside it" if len(answer.models) > 1 else ""
        return f"Model: {answer.source}{beside}."
    if answer.diagnosed:
        return "No backlash is told: no model that is known explains this response."
    return "No backlash is told: the plain model does not explain this response."


def _backlash_table(model: Data, several: bool) -> Markup:
    names = (
        ("contribution_ratio", "contribution ratio r of stage 1", ""),
        ("b1_deg", "backlash of stage 1, b1", "deg"),
        ("b2_deg", "backlash of stage 2, b2", "deg"),
        ("b3_deg", "backlash of stage 3, b3, known", "deg"),
        ("b_t_deg", "total backlash, b_t", "deg"),
    )
    rows = [(label, *_numbers(model[key], unit)) for key, label, unit in names if model.get(key)]
    head = ("", "value", "standard error", "95 % interval")
    told = table(rows, head, row_heads=True)
    if not several:
        return told
    title = f"{model_name(model['causes'])} (probability {model['probability']:.2f})"
    return joined(element("h3", title), told)


def diagnosis_section(data: Data, pictures: Sequence[tuple[Markup, str]]) -> Markup:
    """What the model lacks, why, and what is gained by adding it."""
    diagnosis = data["diagnosis"]
    if diagnosis is None:
        return _section("Diagnosis", element("p", _why(data, "diagnosis")))
    word, swept = diagnosis["verdict"], sweep_lines(diagnosis.get("sweeps", ()))
    return _section(
        "Diagnosis",
        element("p", element("b", f"{word.capitalize()}. "), " ".join(verdict_words(diagnosis))),
        _causes(diagnosis),
        [element("p", f"Taken together: {'; '.join(swept)}.")] if swept else Markup(""),
        _list([*believed_lines(diagnosis), *datasheet_lines(diagnosis)]),
        _gain(diagnosis),
        [
            element("figure", svg, element("figcaption", caption), class_="half")
            for svg, caption in pictures
        ],
        _residuals("Departures from the model of the unit alone", diagnosis.get("residual", [])),
        _residuals("Departures left with the causes", diagnosis.get("residual_after", []))
        if diagnosis["causes"]
        else Markup(""),
        _unseen(diagnosis.get("unseen", []), diagnosis["verdict"]),
        _next(diagnosis.get("next_measurement")),
        _notes(diagnosis.get("warnings", [])),
    )


def provenance_section(data: Data) -> Markup:
    """Software, configuration and hashes, enough to do it again."""
    source = data["provenance"]
    software = ", ".join(f"{k} {v}" for k, v in source["software"].items() if v)
    rows = [
        ("Report made", data["made"]),
        ("Software", f"{software}; Python {source['python']}, {source['machine']}"),
        ("Measured with", data["measurement"].get("software")),
        ("Response, SHA-256", source["response_sha256"]),
        ("File, SHA-256", source["file_sha256"]),
        *(
            (f"{kind.capitalize()} file, SHA-256", one["sha256"])
            for kind, one in source["configurations"].items()
        ),
    ]
    shown = [(name, str(value)) for name, value in rows if value]
    return _section(
        "Provenance",
        table(shown, row_heads=True, class_="facts hashes"),
        element("p", "The page holds a copy of all of this for programs, with every reading and "
                "every configuration: the element ", element("code", "#lashbench-report"),
                ", JSON. The response's hash is that of its ", element("code", "response"),
                " as compact JSON with sorted keys.", class_="small"),
    )  # fmt: skip


def _section(title: str, *children: Markup | str | Sequence[Markup]) -> Markup:
    return element("section", element("h2", title), *children)


def _why(data: Data, name: str) -> str:
    return data["remarks"].get(name) or f"No {name} was made."


def _short(text: str) -> str:
    # A page of remarks would push the rest off the paper; the data hold all of it.
    return text if len(text) <= _MOST_TEXT else f"{text[:_MOST_TEXT]} ... (the rest is in the data)"


def _notes(lines: Sequence[str]) -> Markup:
    """Warnings and flags; repeated ones once."""
    kept = list(dict.fromkeys(lines))
    if not kept:
        return Markup("")
    return element("ul", [element("li", line) for line in kept], class_="notes")


def _list(lines: Sequence[str]) -> Markup:
    return element("ul", [element("li", line) for line in lines]) if lines else Markup("")


def _with_unit(value: Any, unit: str) -> str | None:
    return None if value is None else f"{value:g} {unit}"


def _cycles(how: Data) -> str | None:
    if how["settle_cycles"] is None or how["integrate_cycles"] is None:
        return None
    start = ", from rest" if how["from_rest"] else ""
    return f"{how['settle_cycles']} cycles settled, {how['integrate_cycles']} averaged{start}"


def _flagged(columns: Data) -> str:
    return str(sum(1 for flag in columns["flags"] if flag))


def _numbers(number: Data, unit: str) -> tuple[str, str, str]:
    digits = 4 if unit else 3
    value = "-" if number["value"] is None else f"{number['value']:.{digits}f} {unit}".strip()
    std = number.get("std")
    interval = number.get("interval95")
    known = std is not None and std > 0
    return (
        value,
        f"{std:.{digits}f}" if known else "taken as known",
        f"{interval[0]:.{digits}f} to {interval[1]:.{digits}f}" if interval and known else "",
    )


def _causes(diagnosis: Data) -> Markup:
    if not diagnosis["causes"]:
        return Markup("")
    rows = []
    for cause in diagnosis["causes"]:
        sizes = [
            f"{name} = {with_error(size['value'], size['std'])} {_unit(size['unit'])}".strip()
            if size["value"] is None or abs(size["value"]) >= 1e-3
            else f"{name} = {size['value']:.3g} ± {size['std'] or 0.0:.2g} {_unit(size['unit'])}"
            for name, size in cause["parameters"].items()
        ]
        rows.append(
            (
                cause["effect"],
                _SITES.get(cause.get("site", ""), ""),
                ", ".join(sizes),
                f"{cause['probability']:.2f}",
                cause.get("meaning", ""),
            )
        )
    parts = [table(rows, ("cause", "where", "size", "probability", "meaning"))]
    rivals = [
        f"{' + '.join(rival['causes']) or 'nothing hidden'} "
        f"({', '.join(filter(None, [format(rival['probability'], '.2f'), rival.get('remark')]))})"
        for rival in diagnosis["rivals"]
    ]
    parts += [
        element("p", f"To make sure of {cause['effect']}: {cause['check']}.")
        for cause in diagnosis["causes"]
        if cause.get("check")
    ]
    if rivals:
        parts.append(element("p", f"Other sets judged: {'; '.join(rivals)}."))
    return joined(parts)


def _unit(symbol: str) -> str:
    return "" if symbol == "1" else symbol


def _gain(diagnosis: Data) -> Markup:
    """Held-out residuals before and after."""
    rows = [
        (
            label,
            _number(diagnosis[key]["held_out_rms_sigma"], ".2f"),
            _number(diagnosis[key]["held_out_rms_db"], ".2f"),
        )
        for key, label in (("baseline", "model of the unit alone"), ("extended", "with the causes"))
        if key == "baseline" or diagnosis["causes"]
    ]
    head = ("held-out source levels", "rms / sigma", "rms of gain / dB")
    told = Markup("")
    share = diagnosis["gain"]["held_out_rms_ratio"]
    if diagnosis["causes"] and share is not None:
        change = "smaller" if share < 1.0 else "larger"
        told = element(
            "p",
            f"On source levels that were kept from the fit, the causes leave {share:.2f} of the "
            f"residual: it is {abs(1.0 - share):.0%} {change}.",
        )
    return joined(table(rows, head, row_heads=True), told)


def _number(value: float | None, form: str) -> str:
    return "-" if value is None else format(value, form)


def _residuals(title: str, bands: Sequence[Data]) -> Markup:
    if not bands:
        return element("p", f"{title}: none beyond chance.")
    several = "sweep" in bands[0]
    rows = [
        (
            f"{band['band_hz'][0]:g} to {band['band_hz'][1]:g}",
            *([f"{band['sweep'] + 1}"] if several else []),
            f"{band['source_vpk']:g}",
            band["quantity"],
            f"{band['mean']:+.2f} {'dB' if band['quantity'] == 'gain' else 'deg'}",
            f"{band['sigma']:+.1f}",
        )
        for band in bands[:_MOST_ROWS]
    ]
    more = len(bands) - len(rows)
    heading = f"{title}, strongest first" + (f" ({more} more in the data)" if more else "")
    head = ("band / Hz", *(["sweep"] if several else []), "V peak", "quantity")
    head += ("measured - model", "sigma")
    return joined(element("h3", heading), table(rows, head))


def _unseen(causes: Sequence[Data], verdict: str) -> Markup:
    if not causes:
        return Markup("")
    rows = [(one["effect"], describe_unseen(one)) for one in causes]
    return joined(element("h3", head_unseen(verdict).capitalize()), table(rows, ("cause", "size")))


def _next(proposal: Data | None) -> Markup:
    if not proposal:
        return Markup("")
    first, second = proposal["separates"]
    told = f"To tell {first} from {second} ({proposal['expected_sigma']:.1f} sigma expected)"
    command = proposal["plan"].get("command")
    if not command:
        return element("p", f"{told}, run the plan of next_measurement in the data.")
    return element("p", f"{told}: ", element("code", str(command)))
