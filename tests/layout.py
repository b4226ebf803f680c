"""Measures the boxes of a page in a browser: overlaps, cut text, and excess width."""

from __future__ import annotations

import itertools
import math
import os
import shutil
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from browser import Browser

# Script in the page: text over other text, text cut by its box or by the drawing it is part
# of, and a page wider than its window.
MEASURE = """
(() => {
  const found = [];
  document.querySelectorAll("details").forEach((it) => { it.open = true; });
  const name = (it) => (it.textContent || "").trim().slice(0, 40);
  if (document.documentElement.scrollWidth > innerWidth + 1)
    found.push(`page is ${document.documentElement.scrollWidth} px wide in ${innerWidth}`);
  for (const svg of document.querySelectorAll("svg.marks")) {
    const edge = svg.getBoundingClientRect();
    // Labels that would overlap exist, but are hidden.
    const texts = [...svg.querySelectorAll("text")].filter((it) => it.textContent.trim()
      && getComputedStyle(it).opacity !== "0");
    const boxes = texts.map((it) => [it, it.getBoundingClientRect()]);
    for (const [it, box] of boxes)
      if (box.width && (box.left < edge.left - 2 || box.right > edge.right + 2
          || box.top < edge.top - 2 || box.bottom > edge.bottom + 2))
        found.push(`cut by its drawing: ${name(it)}`);
    boxes.forEach(([a, p], i) => boxes.slice(i + 1).forEach(([b, q]) => {
      const wide = Math.min(p.right, q.right) - Math.max(p.left, q.left);
      const high = Math.min(p.bottom, q.bottom) - Math.max(p.top, q.top);
      if (wide > 2 && high > 4) found.push(`one over the other: ${name(a)} | ${name(b)}`);
    }));
  }
  const boxes = "h1, h2, h3, p, td, th, .tile b, .tile span, .badge";
  for (const it of document.querySelectorAll(boxes)) {
    const style = getComputedStyle(it);
    if (it.scrollWidth > it.clientWidth + 2 && style.overflowX !== "visible" && it.clientWidth)
      found.push(`cut: ${name(it)}`);
  }
  for (const it of document.querySelectorAll(".table"))
    if (it.scrollWidth > it.clientWidth + 2)
      found.push(`table is ${it.scrollWidth} px wide in ${it.clientWidth}: ${name(it)}`);
  return { width: innerWidth, found: [...new Set(found)],
    paper: getComputedStyle(document.body).backgroundColor,
    charts: document.querySelectorAll("svg.marks").length };
})()
"""
DRAWN = (
    "document.readyState === 'complete' && document.querySelectorAll('svg.marks').length"
    " === document.querySelectorAll('.chart').length"
)
HEIGHT_PX = 3000
# Width of a printed page: A4 with margins of a centimetre, at 96 px per inch.
PAPER_PX = 718
# Light and dark pages differ in colours only, so that each width needs one of them.
VIEWS = [(1300, "light"), (800, "dark"), (400, "light"), (PAPER_PX, "print")]
AXE = """
axe.run(document, { resultTypes: ["violations"] }).then((it) => it.violations
  .filter(({ impact }) => ["serious", "critical"].includes(impact))
  .map(({ id, nodes }) => `${id}: ${nodes.map((node) => node.target).join(", ")}`))
"""


# Texts of a chart that are labels of points, with their boxes; those of axes and legend are not.
TEXTS = """
(() => [...document.querySelectorAll('#%s svg .mark-text.role-mark text')]
  .filter(it => it.textContent.trim())
  .map(it => { const box = it.getBoundingClientRect();
    return [it.textContent, box.left, box.top, box.right, box.bottom]; }))()
"""
POINTS = """
(() => [...document.querySelectorAll('#%s svg .mark-symbol.role-mark path')]
  .map(it => { const box = it.getBoundingClientRect();
    return [(box.left + box.right) / 2, (box.top + box.bottom) / 2, box.width / 2]; }))()
"""


def chromium() -> str | None:
    """Returns the browser, or skips without one."""
    return shutil.which("chromium") or shutil.which("chromium-browser")


def measure(browser: Browser, width: int, look: str) -> dict[str, Any]:
    """Returns the layout faults of a page at a window width, light, dark or printed."""
    browser.resize(width, HEIGHT_PX, look="dark" if look == "dark" else "light")
    browser.evaluate("window.isBefore = true")
    browser.call("Page.reload")  # the layout is computed when the page is opened
    browser.wait_for(f"!window.isBefore && {DRAWN}", seconds=60.0)
    browser.resize(width, HEIGHT_PX, look=look)
    browser.evaluate("new Promise((done) => setTimeout(done, 1000))")
    found: dict[str, Any] = browser.evaluate(MEASURE)
    return found


def hindrances(browser: Browser) -> list[str]:
    """Serious and critical findings of axe, if ``ACCESS_AV_AXE`` is the path of ``axe.min.js``."""
    browser.evaluate(Path(os.environ["ACCESS_AV_AXE"]).read_text("utf-8") + ";0")
    found: list[str] = browser.evaluate(AXE)
    return found


def names(label: str) -> list[str]:
    """Returns the names that a label lists: "1, 3–5" are 1, 3, 4 and 5."""
    found: list[str] = []
    for part in filter(None, label.split(", ")):
        first, _, last = part.partition("–")
        found += [first] if not last else [str(it) for it in range(int(first), int(last) + 1)]
    return found


def label_faults(browser: Browser, chart: str, spec: dict[str, Any], width: int) -> list[str]:
    """Returns missing labels of a chart of placed points, and those that cover something.

    A chart is drawn in a window of ``width`` pixels. All rows with a label column are points.
    """
    browser.wait_for(f"document.querySelector('#{chart} svg .role-mark text')", seconds=60.0)
    browser.wait_for(
        f"document.querySelector('#{chart} svg').getBoundingClientRect().width <= {width}"
    )
    # A resized chart is drawn again after a frame.
    browser.evaluate("new Promise(done => setTimeout(done, 500))")
    texts, points = browser.evaluate(TEXTS % chart), browser.evaluate(POINTS % chart)
    edge = browser.evaluate(f"document.querySelector('#{chart} svg').getBoundingClientRect().right")
    [rows] = [rows for rows in spec["datasets"].values() if "label" in rows[0]]
    expected = sorted(it for row in rows for it in names(row["label"]))
    shown = sorted(it for text, *_ in texts for it in names(text))
    found = [] if shown == expected else [f"{shown} instead of {expected}"]
    if len(expected) < len(rows):
        found.append(f"{len(rows) - len(expected)} points have no name")
    if len(points) < len(texts):
        found.append(f"{len(points)} points")
    for (one, *first), (other, *second) in itertools.combinations(texts, 2):
        wide = min(first[2], second[2]) - max(first[0], second[0])
        high = min(first[3], second[3]) - max(first[1], second[1])
        # Boxes of a text contain 3 px of empty space above and below its digits.
        if min(wide, high - 3.0) > 0.0:
            found.append(f"{one} covers {other}")
    for text, left, top, right, bottom in texts:
        if left < 0.0 or right > edge + 1.0:
            found.append(f"{text} is cut")
        for x, y, radius in points:
            dx = max(left - x, x - right, 0.0)
            dy = max(top + 3.0 - y, y - bottom + 3.0, 0.0)
            if math.hypot(dx, dy) <= radius - 1.0:
                found.append(f"{text} covers a point")
    return found
