"""Ask a database of known weaknesses about every package version that is locked.

Run as ``make audit``, or as ``python tests/audit.py [LOCK]``. It needs the extra
``audit`` (pip-audit) and the network, so it is no part of ``make check``. It ends
with 0 only where every version was asked about and none is known to be weak, with
1 where one is, with 2 where the database did not answer: what could not be asked
about is never called sound.
"""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

LOCK = Path(__file__).parents[1] / "requirements.lock"


def ask(lock: Path) -> tuple[str, str]:
    """What pip-audit says of a lock: JSON, and its complaints."""
    words = ("--no-deps", "--disable-pip", "--progress-spinner", "off", "--format", "json")
    done = subprocess.run(
        [sys.executable, "-m", "pip_audit", "--requirement", str(lock), *words],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    return done.stdout, done.stderr


def verdict(said: str, complaints: str) -> tuple[int, list[str]]:
    """Exit code and lines to print."""
    try:
        packages = json.loads(said)["dependencies"]
    except (json.JSONDecodeError, KeyError):
        last = (complaints.strip().splitlines() or ["no answer"])[-1]
        return 2, [f"nothing was audited: {last}"]
    weak = [_weakness(package) for package in packages if package.get("vulns")]
    passed_over = [package["name"] for package in packages if "skip_reason" in package]
    if packages and len(passed_over) == len(packages):
        return 2, ["nothing was audited: the database of known weaknesses did not answer"]
    if passed_over:
        weak.append(f"not audited: {', '.join(passed_over)}")
    if weak:
        return 1 if any(package.get("vulns") for package in packages) else 2, weak
    return 0, [f"{len(packages)} packages audited, none with a known weakness"]


def _weakness(package: dict) -> str:
    told = []
    for one in package["vulns"]:
        fixed = ", ".join(one["fix_versions"])
        told.append(f"{one['id']} (mended in {fixed})" if fixed else f"{one['id']} (not mended)")
    return f"{package['name']} {package['version']}: {'; '.join(told)}"


def main(lock: str = str(LOCK)) -> int:
    """Ask and tell."""
    code, lines = verdict(*ask(Path(lock)))
    print("\n".join(lines), file=sys.stderr if code else sys.stdout)  # noqa: T201
    return code


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
