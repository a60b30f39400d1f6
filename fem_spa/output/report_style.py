"""How the report looks: one sheet, no fonts or files from elsewhere."""

STYLE = """
:root { --ink: #1f2937; --soft: #6b7280; --line: #e5e7eb; --good: #14633b; --bad: #9f2d1d; --mid: #92610a; }
* { box-sizing: border-box; }
body { margin: 0; background: #f6f7f9; color: var(--ink); }
body { font: 16px/1.5 system-ui, "Segoe UI", Roboto, sans-serif; }
main { max-width: 1180px; margin: 0 auto; padding: 24px 20px 60px; }
header { background: #fff; border-left: 8px solid var(--bad); padding: 14px 22px 16px; border-radius: 6px; }
header.done { border-color: var(--good); }
header.interrupted { border-color: var(--mid); }
header p { margin: 4px 0 0; }
header .name { color: var(--soft); font-size: 14px; margin: 0; }
h1 { font-size: 25px; line-height: 1.25; margin: 2px 0 0; }
h2 { font-size: 18px; margin: 0 0 8px; }
section { background: #fff; border-radius: 6px; padding: 16px 22px; margin-top: 14px; }
.tiles { display: flex; flex-wrap: wrap; gap: 6px 36px; padding: 12px 22px; }
.tiles div { display: flex; flex-direction: column; }
.tiles strong { font-size: 21px; }
.tiles span { color: var(--soft); font-size: 13px; }
.warnings { border-left: 8px solid var(--mid); }
.warnings ul { margin: 0; padding-left: 20px; }
.pictures { display: flex; flex-wrap: wrap; gap: 10px; align-items: center; padding: 12px; }
figure { flex: 1 1 460px; margin: 0; text-align: center; }
figure img { max-width: 100%; max-height: 520px; }
figcaption { color: var(--soft); font-size: 13px; }
table { border-collapse: collapse; font-size: 14px; }
th, td { text-align: left; vertical-align: top; padding: 4px 14px 4px 0; }
th, td { border-bottom: 1px solid var(--line); }
th { font-weight: 600; white-space: nowrap; }
.numbers th, .numbers td { text-align: right; font-variant-numeric: tabular-nums; }
.numbers th, .numbers td { padding: 3px 8px; font-size: 13px; }
.numbers .point td { font-weight: 600; }
.scroll { overflow-x: auto; }
small { color: var(--soft); }
pre { background: #f3f4f6; padding: 10px 14px; border-radius: 4px; overflow-x: auto; font-size: 13.5px; }
summary { cursor: pointer; color: var(--soft); margin: 8px 0; }
"""
