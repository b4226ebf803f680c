"""Measures the boxes of a page in a browser: what overlaps, what is cut, what is wider than it."""

from __future__ import annotations

import html
import json
import re
import shutil
import subprocess
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pathlib import Path

# Inside the page: text that lies over other text, text cut by its box or by the drawing it is part
# of, and a page wider than its window.
MEASURE = """
<script>
addEventListener("load", () => setTimeout(() => {
  const found = [];
  const name = (it) => (it.textContent || "").trim().slice(0, 40);
  if (document.documentElement.scrollWidth > innerWidth + 1)
    found.push(`page is ${document.documentElement.scrollWidth} px wide in ${innerWidth}`);
  for (const svg of document.querySelectorAll("svg.marks")) {
    const edge = svg.getBoundingClientRect();
    const texts = [...svg.querySelectorAll("text")].filter((it) => it.textContent.trim());
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
  const all = { width: innerWidth, found: [...new Set(found)],
    charts: document.querySelectorAll("svg.marks").length };
  const told = document.createElement("pre");
  told.id = "measured";
  told.textContent = JSON.stringify(all);
  document.body.append(told);
}, 1500));
</script>
"""


def chromium() -> str | None:
    """The browser, where there is one."""
    return shutil.which("chromium") or shutil.which("chromium-browser")


def measure(page: Path, folder: Path, width: int, *, dark: bool = False) -> dict[str, Any]:
    """What a browser finds of a page in a window of some width."""
    copy = folder / f"{page.stem}-{width}-{dark}.html"
    text = page.read_text("utf-8")
    body, _, end = text.rpartition("</body>")  # the code that draws charts speaks of it, too
    copy.write_text(f"{body}{MEASURE}</body>{end}", "utf-8")
    # A browser's own window has a least width; a frame has none.
    frame = folder / f"frame-{width}-{dark}.html"
    frame.write_text(
        f'<body style="margin:0"><iframe id="it" style="border:0;width:{width}px;height:3000px" '
        f'src="{copy.name}"></iframe><script>setTimeout(() => document.body.append(Object.assign('
        'document.createElement("pre"), {textContent: document.getElementById("it")'
        '.contentDocument.getElementById("measured").textContent})), 4000)</script></body>',
        "utf-8",
    )
    scheme = ["--blink-settings=preferredColorScheme=0"] if dark else []
    done = subprocess.run(
        [
            str(chromium()),
            *("--headless", "--no-sandbox", "--disable-gpu", "--allow-file-access-from-files"),
            *("--window-size=1400,3000", "--virtual-time-budget=8000", *scheme, "--dump-dom"),
            frame.as_uri(),
        ],
        capture_output=True,
        text=True,
        timeout=240,
        check=True,
    )
    told = re.search(r"<pre>(\{.*?\})</pre>", done.stdout, re.S)
    assert told, done.stdout[-500:] + done.stderr[-500:]
    found: dict[str, Any] = json.loads(html.unescape(told[1]))
    return found
