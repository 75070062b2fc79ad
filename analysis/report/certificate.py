"""What makes a report a certificate: its number, the calibration, the limits and the approval.

Owns these facts and their sections. Like the other sections they show nothing that the page's
document does not hold.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import date
from typing import Any

from analysis.acceptance.judgement import Judgement
from analysis.report.html import Markup, element, joined, table

__all__ = [
    "Certificate",
    "approval_section",
    "certificate_data",
    "conformity_section",
    "page_style",
]

Data = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Certificate:
    """What a certificate says beside what was measured; whatever is empty is left out.

    Parameters
    ----------
    number
        Of the report; made from date and data, if empty.
    organisation
        Who issues it.
    calibrated, calibration_due
        Dates of the instrument's calibration.
    calibration_certificate
        Its number.
    environment
        Conditions by name, as ``{"temperature": "22.5 degC"}``.
    approver
        Who approves it.
    logo
        A ``data:`` address of a picture; see `analysis.report.logo`.
    """

    number: str = ""
    organisation: str = ""
    calibrated: date | None = None
    calibration_due: date | None = None
    calibration_certificate: str = ""
    environment: Mapping[str, str] = field(default_factory=dict)
    approver: str = ""
    logo: str = ""


def certificate_data(certificate: Certificate, data: Data) -> dict[str, Any]:
    """The part of a report's document that it is a certificate by."""
    measured = str(data["measurement"].get("started") or data["made"])[:10]
    due = certificate.calibration_due
    digest = data["provenance"]["response_sha256"]
    return {
        "number": certificate.number or f"LB-{data['made'][:10].replace('-', '')}-{digest[:8]}",
        "organisation": certificate.organisation,
        "calibrated": None
        if certificate.calibrated is None
        else certificate.calibrated.isoformat(),
        "calibration_due": None if due is None else due.isoformat(),
        "calibration_overdue": due is not None and due.isoformat() < measured,
        "calibration_certificate": certificate.calibration_certificate,
        "environment": dict(certificate.environment),
        "approver": certificate.approver,
    }


def issued(data: Data) -> list[str]:
    """Number, day and issuer of the report."""
    told = data["certificate"]
    words = [f"Report {told['number']}", data["made"][:10], told["organisation"]]
    return [word for word in words if word]


def head_rows(data: Data) -> list[tuple[str, str | None]]:
    """Rows of the facts: calibration of the instrument, environment."""
    told = data["certificate"]
    calibrated = told["calibrated"]
    if told["calibration_due"]:
        calibrated = f"{calibrated or 'date unknown'}, due {told['calibration_due']}"
    if calibrated and told["calibration_certificate"]:
        calibrated += f", certificate {told['calibration_certificate']}"
    if told["calibration_overdue"]:
        calibrated += "; it was OVERDUE when this was measured"
    return [
        ("Calibration of the instrument", calibrated),
        *((f"Environment: {name}", value) for name, value in told["environment"].items()),
    ]


def conformity_section(judgement: Judgement | None) -> Markup:
    """The verdict, each limit with the value and its guard band, and the decision rule."""
    if judgement is None:
        return Markup("")
    rows = [
        (
            item.name,
            item.measured,
            _guarded(item.to_json()["guarded"]),
            item.limit,
            f"{item.verdict}: {item.reason}" if item.reason else item.verdict,
        )
        for item in judgement.items
    ]
    head = ("quantity", "value", "with guard band", "limit", "decision")
    return element(
        "section",
        element("h2", "Conformity"),
        element(
            "p",
            element("b", judgement.verdict, class_=f"verdict {judgement.verdict.lower()}"),
            f" by limits {judgement.limits.name}.",
        ),
        table(rows, head),
        element("p", f"Decision rule: {judgement.rule}.", class_="small"),
    )


def _guarded(span: Any) -> str:
    return "-" if span is None else f"{span[0]:.4g} to {span[1]:.4g}"


def approval_section(data: Data) -> Markup:
    """Lines to sign on, for who measured and who approves."""
    people = (
        ("Measured by", data["measurement"].get("operator")),
        ("Approved by", data["certificate"]["approver"]),
    )
    blocks = [
        element(
            "div",
            element("p", title, class_="small"),
            element("p", str(name or ""), class_="name"),
            element("p", "date, signature", class_="small line"),
            class_="sign",
        )
        for title, name in people
    ]
    return element("section", element("h2", "Approval"), element("div", blocks, class_="signs"),
                   class_="approval")  # fmt: skip


def logo_picture(logo: str) -> Markup:
    """The logo at the head of the page."""
    return element("img", src=logo, alt="", class_="logo") if logo else Markup("")


def page_style(data: Data) -> Markup:
    """Number and pages at the foot of each sheet of paper."""
    number = _css_text(f"Report {data['certificate']['number']}")
    return joined(
        Markup(
            f"@page {{ @bottom-left {{ content: {number}; }} "
            '@bottom-right { content: "page " counter(page) " of " counter(pages); } }'
        )
    )


def _css_text(text: str) -> str:
    """A string of a style sheet: nothing in it can end the string or the sheet."""
    safe = "".join(c if c.isascii() and c.isalnum() else f"\\{ord(c):x} " for c in text)
    return f'"{safe}"'
