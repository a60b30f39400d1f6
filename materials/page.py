"""One self-contained page of a fit: picture, table, parameters with intervals, warnings, the card."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from html import escape

from materials.card_writer import card_toml
from materials.job import Outcome, table_rows

STYLE = """
body { margin: 0; background: #f6f7f9; color: #1f2937; font: 16px/1.5 system-ui, "Segoe UI", sans-serif; }
main { max-width: 1180px; margin: 0 auto; padding: 24px 20px 60px; }
header { background: #fff; border-left: 8px solid #14633b; padding: 14px 22px; border-radius: 6px; }
header.mind { border-color: #92610a; }
h1 { font-size: 25px; line-height: 1.25; margin: 2px 0; } h2 { font-size: 18px; margin: 0 0 8px; }
section { background: #fff; border-radius: 6px; padding: 16px 22px; margin-top: 14px; overflow-x: auto; }
img { max-width: 100%; } ul { margin: 0; padding-left: 20px; } small { color: #6b7280; }
table { border-collapse: collapse; font-size: 14px; }
th, td { text-align: left; padding: 4px 16px 4px 0; border-bottom: 1px solid #e5e7eb; }
.best td { font-weight: 600; }
pre { background: #f3f4f6; padding: 10px 14px; border-radius: 4px; overflow-x: auto; font-size: 13px; }
"""


def page(outcome: Outcome, picture: bytes, command: str) -> str:
    """HTML with the picture (PNG) inside it."""
    fit, u = outcome.chosen.fit, outcome.chosen.uncertainty
    image = base64.b64encode(picture).decode("ascii")
    mind = " class='mind'" if outcome.warnings else ""
    parts = [
        f"<!doctype html><html lang='en'><meta charset='utf-8'><title>{escape(outcome.card.name)}</title>",
        f"<style>{STYLE}</style><main><header{mind}><small>fem-spa fit</small>",
        f"<h1>{escape(outcome.card.name)}: {escape(fit.name)}</h1>",
        f"<p>rmse {fit.rmse / 1e3:.3g} kPa, {100 * fit.rmse_share:.2g} % of the largest stress; "
        f"{_stable_words(outcome)}</p></header>",
        f"<section><img alt='data and laws' src='data:image/png;base64,{image}'></section>",
    ]
    if outcome.warnings:
        parts.append(
            "<section><h2>Mind</h2><ul>" + "".join(f"<li>{escape(w)}</li>" for w in outcome.warnings)
        )
        parts.append("</ul></section>")
    rows = table_rows(outcome)
    table = _table(list(rows[0]), [list(r.values()) for r in rows], [r["law"].startswith("*") for r in rows])
    parts.append(f"<section><h2>Laws, by error on what was held out</h2>{table}")
    parts.append(
        f"<p><small>Held out: {escape(outcome.ranking.scheme)}. * recommended: least such error among the "
    )
    parts.append("stable laws, fewest parameters of those within 5 %.</small></p></section>")
    cells = []
    for name in fit.variant.free:
        unit, scale = ("MPa", 1e6) if fit.law.parameters[name] == "Pa" else ("1", 1.0)
        low, high = (None, None) if u is None else u.intervals[name]
        cells.append(
            [name, f"{fit.parameters[name] / scale:.6g}", _number(low, scale), _number(high, scale), unit]
        )
    parts.append(f"<section><h2>Parameters</h2>{_table(['', 'value', 'low', 'high', 'unit'], cells)}")
    if u is not None:
        corr = [
            [n, *(f"{v:+.3f}" for v in row)] for n, row in zip(fit.variant.free, u.correlation, strict=True)
        ]
        parts.append(f"<p>95 % intervals: {escape(str(outcome.card.fit['intervals']))}. Correlations:</p>")
        parts.append(_table(["", *fit.variant.free], corr))
    parts.append("</section>")
    for s, series in outcome.prony:
        cells = [
            [f"{g:.4g}", f"{a:.4g} to {b:.4g}", f"{t:.4g}"]
            for g, a, b, t in zip(series.g, series.g_low, series.g_high, series.tau, strict=True)
        ]
        parts.append(
            f"<section><h2>Prony series, {escape(s.name)}</h2>"
            f"{_table(['g', '95 %', 'tau [s]'], cells)}</section>"
        )
    for s, m in outcome.mullins:
        cells = [
            [n, f"{v:.4g}", f"{a:.4g} to {b:.4g}"]
            for n, v, a, b in zip(("r", "m [Pa]", "beta"), (m.r, m.m, m.beta), m.low, m.high, strict=True)
        ]
        parts.append(
            f"<section><h2>Mullins, {escape(s.name)}</h2>{_table(['', 'value', '95 %'], cells)}"
            f"<p>rmse {m.rmse / 1e3:.3g} kPa, {m.rmse_without / 1e3:.3g} kPa without.</p></section>"
        )
    if outcome.notes:
        parts.append(
            "<section><h2>Found in the tests</h2><ul>"
            + "".join(f"<li>{escape(n)}</li>" for n in outcome.notes)
        )
        parts.append("</ul></section>")
    parts.append(f"<section><h2>Card</h2><pre>{escape(card_toml(outcome.card))}</pre>")
    parts.append(f"<p>Made with</p><pre>{escape(command)}</pre></section></main></html>")
    return "\n".join(parts)


def _stable_words(outcome: Outcome) -> str:
    if outcome.chosen.stable:
        ranges = ", ".join(f"{m} {a:.2f} to {b:.2f}" for m, (a, b) in outcome.chosen.stable_ranges.items())
        return f"stable all over the range asked ({ranges})"
    ranges = ", ".join(f"{m} {a:.2f} to {b:.2f}" for m, (a, b) in outcome.chosen.stable_ranges.items())
    return f"stable only in {ranges}"


def _number(value: float | None, scale: float) -> str:
    return "" if value is None else f"{value / scale:.6g}"


def _table(head: Sequence[str], rows: Sequence[Sequence[str]], best: Sequence[bool] | None = None) -> str:
    top = "".join(f"<th>{escape(h)}</th>" for h in head)
    body = ""
    for i, row in enumerate(rows):
        style = " class='best'" if best is not None and best[i] else ""
        body += f"<tr{style}>" + "".join(f"<td>{escape(c)}</td>" for c in row) + "</tr>"
    return f"<table><tr>{top}</tr>{body}</table>"
