"""How the bench screen looks: one style sheet for all steps.

Owns layout and emphasis. Small and narrow terminals lose decoration here and
nothing else; no meaning rests on a colour.
"""

__all__ = ["STYLE"]

STYLE = """
Screen { layers: base dialog; }
#step-bar { height: 1; background: $panel; }
#banner { height: 1; background: $surface; text-style: bold; }
#banner, #step-bar, #hint { text-wrap: nowrap; text-overflow: ellipsis; }
#banner.-driving { background: $warning; color: black; }
#banner.-alarm { background: $error; color: white; }
#body { height: 1fr; }
#hint { height: 1; background: $surface; color: $text-accent; }
.pane { padding: 0 1; }
.heading { text-style: bold; height: 1; color: $text-accent; }
.heading { text-wrap: nowrap; text-overflow: ellipsis; }
.scroll { overflow-y: auto; }
Input.-textual-compact { height: 1; }
.field { height: 1; }
.field Label { width: 18; }
.field Input { width: 1fr; }
OptionList, DataTable { background: $background; }
Dialog { align: center middle; }
Dialog > #dialog {
    width: 76; max-width: 96%; height: auto; max-height: 90%;
    border: round $accent; background: $surface; padding: 0 1;
}
Dialog #title { text-style: bold; }
Dialog TextArea { height: auto; max-height: 12; min-height: 3; border: none; }
Dialog #keys { height: 1; color: $text-accent; }
ToastRack { dock: top; align: right top; margin-top: 2; }
#info { height: auto; max-height: 4; }
#progress { height: 1; }
.side { width: 40; }
.-short .decoration { display: none; }
.-narrow .wide-only { display: none; }
"""
