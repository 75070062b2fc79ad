"""The look of a report, on a screen and on paper.

Owns the style sheet. It names no font and no picture that would have to be
fetched.
"""

__all__ = ["STYLE"]

STYLE = """
@page { size: A4; margin: 14mm 14mm 18mm 14mm; font: 8px/1.4 Verdana, Arial, sans-serif; }
* { box-sizing: border-box; }
html { font: 15px/1.4 system-ui, "DejaVu Sans", Verdana, Arial, sans-serif; color: #1a1a1a; }
body { max-width: 60rem; margin: 0 auto; padding: 1.2rem; background: #fff;
  overflow-wrap: anywhere; }
h1 { font-size: 1.6rem; line-height: 1.2; margin: 0 0 .5rem; }
h2 { font-size: 1.15rem; margin: 1.6rem 0 .5rem; padding-bottom: .15rem;
  border-bottom: 2px solid #0072b2; }
h3 { font-size: .95rem; margin: 1rem 0 .3rem; }
p, ul { margin: .4rem 0; }
ul { padding-left: 1.3rem; }
table { border-collapse: collapse; width: 100%; margin: .5rem 0; font-size: .85rem;
  font-variant-numeric: tabular-nums; overflow-wrap: normal; }
th, td { text-align: left; vertical-align: top; padding: .16rem .5rem .16rem 0;
  border-bottom: 1px solid #d8d8d8; overflow-wrap: anywhere; }
thead th { color: #444; font-weight: 600; border-bottom: 1.5px solid #888; overflow-wrap: normal; }
tbody th { font-weight: 600; }
.figures td, .figures th { white-space: nowrap; }
.facts th { width: 12rem; }
.hashes td { font-family: ui-monospace, "DejaVu Sans Mono", monospace; font-size: .78rem; }
.actions { list-style: none; padding: .6rem .8rem; background: #eaf3f9;
  border-left: 4px solid #0072b2; }
.actions li:first-child { font-weight: 600; }
.simulated { background: #fbe6d9; border-left: 4px solid #d55e00; padding: .5rem .8rem;
  font-weight: 600; }
.verdict { padding: .1rem .5rem; border: 2px solid; }
.verdict.pass { color: #00583f; }
.verdict.fail { color: #a33c00; }
.verdict.undecided { color: #4d4d4d; border-style: dashed; }
.notes, figcaption, .small { color: #555; font-size: .8rem; }
ul.notes { columns: 24rem; }
figure { margin: .6rem 0; }
figure svg { width: 100%; height: auto; display: block; }
svg * { stroke-linejoin: round; stroke-linecap: butt; }
code { font-family: ui-monospace, "DejaVu Sans Mono", monospace; font-size: .85em; }
.simulated, .actions { clear: right; }
.logo { float: right; max-height: 3.2rem; max-width: 12rem; margin-left: 1rem; }
.signs { display: flex; gap: 2rem; }
.sign { flex: 1; }
.sign .name { min-height: 3.4rem; margin: 0; }
.sign .line { border-top: 1px solid #555; padding-top: .2rem; }
@media (max-width: 40rem) {
  body { padding: .7rem; }
  table { display: block; overflow-x: auto; }
  .facts th { width: 8rem; }
  figure { overflow-x: auto; }
  figure svg { min-width: 34rem; }
  .signs { flex-direction: column; gap: .5rem; }
}
@media print {
  html { font-size: 11.5px; }
  body { max-width: none; padding: 0; }
  figure, table, .actions, .approval, tr { break-inside: avoid; }
  h2, h3 { break-after: avoid; }
  * { -webkit-print-color-adjust: exact; print-color-adjust: exact; }
}
"""
"""Cascading style sheet of the page."""
