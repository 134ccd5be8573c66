# SPDX-License-Identifier: BSD-3-Clause
"""Small multiples of lines as one SVG file; nothing but the standard library."""
import html
import math

WIDTH, HEIGHT, COLUMNS = 300, 210, 3
LEFT, RIGHT, TOP, BOTTOM = 46, 8, 22, 30
COLOURS = ["#d62728", "#1f77b4", "#2ca02c", "#9467bd", "#8c564b", "#ff7f0e", "#17becf", "#7f7f7f", "#222222"]


class Axis:
    def __init__(self, values, low, high, logarithmic):
        self.log = logarithmic
        values = [v for v in values if v is not None and (v > 0 or not logarithmic)] or [1.0]
        self.first, self.last = self.map(min(values)), self.map(max(values))
        margin = 0.05 * (self.last - self.first) or 0.5
        self.first, self.last, self.low, self.high = self.first - margin, self.last + margin, low, high

    def map(self, value):
        return math.log10(value) if self.log else value

    def __call__(self, value):
        return self.low + (self.high - self.low) * (self.map(value) - self.first) / (self.last - self.first)

    def ticks(self):
        if self.log:
            fine = (1, 2, 5) if self.last - self.first > 0.6 else (1, 1.5, 2, 2.5, 3, 4, 5, 6, 7, 8, 9)
            values = [m * 10.0 ** e for e in range(math.floor(self.first), math.ceil(self.last) + 1) for m in fine]
        else:
            step = 10.0 ** math.floor(math.log10(self.last - self.first))
            step = step / 2 if (self.last - self.first) / step < 3 else step
            values = [k * step for k in range(math.floor(self.first / step), math.ceil(self.last / step) + 1)]
        inside = [v for v in values if self.first <= self.map(v) <= self.last]
        return inside if len(inside) < 7 else inside[::2]


def text(x, y, words, anchor="start", size=10, weight="normal"):
    return (f'<text x="{x:.1f}" y="{y:.1f}" font-size="{size}" text-anchor="{anchor}" font-weight="{weight}">'
            f"{html.escape(words)}</text>")


def panel(x0, y0, title, lines, colour, x_log, y_log):
    """`lines`: name -> [(x, y)] or [(x, y, low, high)], the latter with a band."""
    points = [p for line in lines.values() for p in line]
    x = Axis([p[0] for p in points], x0 + LEFT, x0 + WIDTH - RIGHT, x_log)
    y = Axis([v for p in points for v in p[1:]], y0 + HEIGHT - BOTTOM, y0 + TOP, y_log)
    out = [text(x0 + LEFT, y0 + 14, title, size=11, weight="bold"),
           f'<rect x="{x0 + LEFT}" y="{y0 + TOP}" width="{WIDTH - LEFT - RIGHT}" height="{HEIGHT - TOP - BOTTOM}" '
           'fill="none" stroke="#999"/>']
    for v in x.ticks():
        out.append(text(x(v), y0 + HEIGHT - BOTTOM + 13, f"{v:g}", "middle", 9))
    for v in y.ticks():
        out.append(text(x0 + LEFT - 4, y(v) + 3, f"{v:g}", "end", 9))
        out.append(f'<path d="M{x0 + LEFT} {y(v):.1f}H{x0 + WIDTH - RIGHT}" stroke="#e4e4e4"/>')
    for name, line in reversed(lines.items()):  # the first one on top
        line = [p for p in line if p[1] > 0 or not y_log]
        if not line:
            continue
        if len(line[0]) == 4:
            band = [(p[0], p[3]) for p in line] + [(p[0], p[2]) for p in reversed(line)]
            if all(v > 0 for _, v in band) or not y_log:
                out.append('<polygon points="' + " ".join(f"{x(a):.1f},{y(b):.1f}" for a, b in band)
                           + f'" fill="{colour[name]}" opacity="0.18"/>')
        out.append('<polyline points="' + " ".join(f"{x(p[0]):.1f},{y(p[1]):.1f}" for p in line)
                   + f'" fill="none" stroke="{colour[name]}" stroke-width="1.6"/>')
    return out


def write(path, panels, x_title, y_title, x_log=True, y_log=True):
    """`panels`: title -> lines, see panel(). One legend for all."""
    names = list(dict.fromkeys(name for lines in panels.values() for name in lines))
    colour = {name: COLOURS[k % len(COLOURS)] for k, name in enumerate(names)}
    columns = min(COLUMNS, len(panels))
    width, height = max(columns * WIDTH, 110 * len(names)), 26 + HEIGHT * math.ceil(len(panels) / columns) + 18
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" '
           f'viewBox="0 0 {width} {height}" font-family="sans-serif">', '<rect width="100%" height="100%" fill="white"/>']
    for k, name in enumerate(names):
        out.append(f'<path d="M{8 + 110 * k} 13h16" stroke="{colour[name]}" stroke-width="3"/>')
        out.append(text(28 + 110 * k, 17, name, size=11))
    for k, (title, lines) in enumerate(panels.items()):
        out += panel(WIDTH * (k % columns), 26 + HEIGHT * (k // columns), title, lines, colour, x_log, y_log)
    out += [text(width / 2, height - 6, f"across: {x_title}; upward: {y_title}", "middle", 11), "</svg>"]
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join(out) + "\n")
