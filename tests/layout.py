"""Measures the boxes of a page in a browser: overlaps, cut text, and excess width."""

from __future__ import annotations

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
# Windows, and what a PDF has: a sheet of A4 between margins of a centimetre, at 96 px an inch.
PAPER_PX = 718
VIEWS = [*((width, look) for width in (1300, 800, 400) for look in ("light", "dark"))]
VIEWS.append((PAPER_PX, "print"))
AXE = """
axe.run(document, { resultTypes: ["violations"] }).then((it) => it.violations
  .filter(({ impact }) => ["serious", "critical"].includes(impact))
  .map(({ id, nodes }) => `${id}: ${nodes.map((node) => node.target).join(", ")}`))
"""


def chromium() -> str | None:
    """Returns the browser, or skips without one."""
    return shutil.which("chromium") or shutil.which("chromium-browser")


def measure(browser: Browser, width: int, look: str) -> dict[str, Any]:
    """Returns the layout faults of a page at a window width, light, dark or printed."""
    browser.resize(width, HEIGHT_PX, look="dark" if look == "dark" else "light")
    browser.evaluate("window.isBefore = true")
    browser.call("Page.reload")  # a page is laid out for the window in which it is opened
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
