"""Plots on logarithmic axes as SVG, by the standard library alone.

A Canvas gathers what is drawn, in pixels from its upper left corner; a Panel maps data to pixels of a part of it. Panels side by
side are small multiples: the same axes, one panel for each case.

Why so plain: a figure of the page must read in a light and in a dark page, in print, and without telling colours apart. So its ground
is always white, series differ in marker and carry their names, and colours are those of Okabe & Ito, "Color Universal Design" (2008).
Numbers are written with a fixed number of digits, so that the same figures give the same bytes.

Test: tests/house/test_performance_page.py
"""
import html
import math
from typing import NamedTuple

INK, SOFT, GRID, GROUND = "#222222", "#666666", "#dddddd", "#ffffff"
WIDTH = 900
LABEL_GAP = 13  # pixels between the base lines of labels that must not overlap
SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


class Look(NamedTuple):
    """What tells one series from another: never the colour alone."""
    colour: str
    marker: str
    hollow: bool = False


LOOKS = [Look("#0072b2", "circle"), Look("#d55e00", "square"), Look("#009e73", "triangle"), Look("#cc79a7", "diamond")]

# Around the origin, at the size that looks as large as a circle of radius 4.
MARKERS = {
    "circle": '<circle r="4"/>',
    "square": '<rect x="-3.6" y="-3.6" width="7.2" height="7.2"/>',
    "triangle": '<path d="M0,-5L4.6,3.6H-4.6Z"/>',
    "diamond": '<path d="M0,-5.2L5.2,0L0,5.2L-5.2,0Z"/>',
    "wedge": '<path d="M0,5L4.6,-3.6H-4.6Z"/>',
}


def looks_of(names):
    """The look of each name, by its place in the list; the fifth looks like the first, but carries another label."""
    return {name: LOOKS[i % len(LOOKS)] for i, name in enumerate(names)}


class Picture(NamedTuple):
    """A file of docs/images, and what it shows in words."""
    name: str
    svg: str
    alt: str


class Canvas:
    def __init__(self, height):
        self.height = height
        self.elements = []

    def line(self, points, colour, width=1.0, dash=None):
        dashes = f' stroke-dasharray="{dash}"' if dash else ""
        path = "L".join(f"{x:.1f},{y:.1f}" for x, y in points)
        self.elements.append(f'<path d="M{path}" fill="none" stroke="{colour}" stroke-width="{width}"{dashes}/>')

    def text(self, x, y, words, colour=INK, size=12, anchor="start", bold=False, turned=False):
        """With a white rim, so that a label reads on top of lines."""
        weight = ' font-weight="bold"' if bold else ""
        turn = f' transform="rotate(-90 {x:.1f} {y:.1f})"' if turned else ""
        self.elements.append(
            f'<text x="{x:.1f}" y="{y:.1f}" fill="{colour}" font-size="{size}" text-anchor="{anchor}"{weight}{turn} '
            f'stroke="{GROUND}" stroke-width="3" stroke-linejoin="round" paint-order="stroke">{html.escape(words)}</text>')

    def marker(self, x, y, look, hint):
        """The hint is told by viewers that show titles, when the figure is opened by itself."""
        fill, rim, rim_width = (GROUND, look.colour, 1.6) if look.hollow else (look.colour, GROUND, 1)
        self.elements.append(f'<g transform="translate({x:.1f} {y:.1f})" fill="{fill}" stroke="{rim}" stroke-width="{rim_width}">'
                             f"<title>{html.escape(hint)}</title>{MARKERS[look.marker]}</g>")

    def svg(self, description):
        head = (f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{self.height:.0f}" '
                f'viewBox="0 0 {WIDTH} {self.height:.0f}" role="img" font-family="sans-serif">')
        ground = f'<rect width="100%" height="100%" fill="{GROUND}"/>'
        return "\n".join([head, f"<desc>{html.escape(description)}</desc>", ground, *self.elements, "</svg>", ""])


class Axis(NamedTuple):
    """A logarithmic axis from low to high, with the values that carry a tick."""
    low: float
    high: float
    ticks: list

    def place(self, value):
        """0 at the low end, 1 at the high end."""
        return math.log(value / self.low) / math.log(self.high / self.low)


def round_ticks(low, high, most=8):
    """1, 2 and 5 of every decade; where that is too many, 1 alone, and then every second decade, every third, ..."""
    decades = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    for digits, step in [((1, 2, 5), 1), *(((1,), step) for step in range(1, len(decades) + 1))]:
        ticks = [digit * 10.0**decade for decade in decades if decade % step == 0 for digit in digits]
        ticks = [tick for tick in ticks if low <= tick <= high]
        if len(ticks) <= most:
            return ticks
    return []


def binary_ticks(low, high, most=9):
    """Powers of two, or of four, eight, ... where that is too many."""
    powers = range(math.ceil(math.log2(low)), math.floor(math.log2(high)) + 1)
    return [2.0**power for power in powers if power % math.ceil(len(powers) / most) == 0]


def tick_text(value):
    if 1e-3 <= value < 1e5:
        return f"{value:,.10g}"
    exponent = math.floor(math.log10(value) + 1e-9)
    digit = round(value / 10.0**exponent)
    return ("" if digit == 1 else f"{digit}·") + "10" + str(exponent).translate(SUPERSCRIPTS)


def decades(values):
    return math.log10(max(values) / min(values))


def axis_around(values, span, before=0.06, after=0.06, ticks=round_ticks):
    """`span` decades with the values in their middle; before and after are what stays free, as fractions of the axis."""
    middle = math.sqrt(min(values) * max(values))
    axis_span = span / (1 - before - after)
    low = middle / 10**(span / 2 + axis_span * before)
    high = low * 10**axis_span
    return Axis(low, high, ticks(low, high))


class Label(NamedTuple):
    x: float
    y: float
    words: str
    colour: str


def spread(places, gap=LABEL_GAP):
    """Moves places apart to at least `gap`, none further than it must: clusters stay centred on what they stand for."""
    order = sorted(range(len(places)), key=lambda i: places[i])
    clusters = []  # of [sum of the wished places, count]: its middle is their mean
    for i in order:
        clusters.append([places[i], 1])
        while len(clusters) > 1:
            (upper, n), (lower, m) = clusters[-2:]
            if lower / m - gap * (m - 1) / 2 - (upper / n + gap * (n - 1) / 2) >= gap:
                break
            clusters[-2:] = [[upper + lower, n + m]]
    spaced = [total / n + gap * (k - (n - 1) / 2) for total, n in clusters for k in range(n)]
    moved = dict(zip(order, spaced))
    return [moved[i] for i in range(len(places))]


class Panel:
    """A part of a canvas with axes of its own: left, top, width and height are those of the area of the data."""

    def __init__(self, canvas, left, top, width, height, x_axis, y_axis=None):
        self.canvas, self.x_axis, self.y_axis = canvas, x_axis, y_axis
        self.left, self.top, self.right, self.bottom = left, top, left + width, top + height

    def x(self, value):
        return self.left + (self.right - self.left) * self.x_axis.place(value)

    def y(self, value):
        return self.bottom - (self.bottom - self.top) * self.y_axis.place(value)

    def draw_axes(self, title, x_title, y_title=""):
        for value in self.x_axis.ticks:
            self.canvas.line([(self.x(value), self.top), (self.x(value), self.bottom)], GRID)
            self.canvas.text(self.x(value), self.bottom + 16, tick_text(value), SOFT, 11, "middle")
        for value in self.y_axis.ticks if self.y_axis else ():
            self.canvas.line([(self.left, self.y(value)), (self.right, self.y(value))], GRID)
            self.canvas.text(self.left - 6, self.y(value) + 4, tick_text(value), SOFT, 11, "end")
        corners = [(self.left, self.top), (self.left, self.bottom), (self.right, self.bottom)]
        self.canvas.line(corners, SOFT)
        self.canvas.text(self.left, self.top - 10, title, size=13, bold=True)
        self.canvas.text((self.left + self.right) / 2, self.bottom + 34, x_title, anchor="middle")
        if y_title:
            self.canvas.text(self.left - 46, (self.top + self.bottom) / 2, y_title, anchor="middle", turned=True)

    def draw_labels(self, labels):
        """To the right of their places, moved apart where they would overlap."""
        for label, y in zip(labels, spread([label.y for label in labels])):
            self.canvas.text(label.x + 9, y + 4, label.words, label.colour, 12, bold=label.colour != SOFT)


def lay_out_panels(count, key_height=0):
    """The height of a canvas for so many panels below a key, and for each: left, top, width, height of its data."""
    columns = 1 if count == 1 else 2 if count <= 4 else 3
    cell_width, cell_height = WIDTH / columns, {1: 420, 2: 330, 3: 290}[columns]
    boxes = [(cell_width * (i % columns) + 64, key_height + cell_height * (i // columns) + 34, cell_width - 78, cell_height - 84)
             for i in range(count)]
    return key_height + cell_height * math.ceil(count / columns), boxes
