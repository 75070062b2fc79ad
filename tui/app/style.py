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
#hint { height: 1; background: $surface; color: $foreground; text-style: bold; }
.pane { padding: 0 1; }
.heading { text-style: bold underline; height: 1; color: $foreground; }
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
Dialog TextArea { height: auto; max-height: 16; min-height: 3; border: none; }
Dialog #keys { height: 1; color: $foreground; text-style: bold; }
Footer, FooterKey { color: $foreground; }
FooterKey .footer-key--key, FooterKey .footer-key--description { color: $foreground; }
FooterKey .footer-key--key { text-style: bold; }
Input > .input--placeholder { color: $foreground 80%; }
OptionList > .option-list--option-highlighted { color: $foreground; background: $panel; }
DataTable > .datatable--cursor { background: $foreground; color: $background; }
DataTable > .datatable--header { color: $foreground; background: $panel; }
OptionList:focus > .option-list--option-highlighted { text-style: reverse bold; }
ToastRack { dock: top; align: right top; margin-top: 2; }
#info { height: auto; max-height: 4; }
#progress { height: 1; }
.side { width: 40; }
.-short .decoration { display: none; }
.-narrow .wide-only { display: none; }
"""
