"""A page as SVG."""

from __future__ import annotations

from html import escape

from markerscope.solver.figures.drawing import Colour, Line, Page, Text, pieces


def svg(page: Page) -> str:
    """The page as text of an SVG file; its size is in points, its text stays text."""
    size = f'width="{page.width:g}pt" height="{page.height:g}pt" viewBox="0 0 {page.width:g} {page.height:g}"'
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" {size} role="img" aria-label="{escape(page.title)}" '
        'font-family="Helvetica, Arial, sans-serif">'
    )
    back = f'<rect width="{page.width:g}" height="{page.height:g}" fill="#ffffff"/>'
    drawn = [_line(item) if isinstance(item, Line) else _text(item) for item in page.items]
    return "\n".join([head, back, *filter(None, drawn), "</svg>"]) + "\n"


def _line(line: Line) -> str:
    path = "".join(
        "M" + "L".join(f"{x:.2f} {y:.2f}" for x, y in piece) + ("Z" if line.fill is not None else "")
        for piece in pieces(line.points)
    )
    if not path:
        return ""
    if line.fill is not None:
        return f'<path d="{path}" fill="{_hex(line.fill)}" fill-opacity="{line.opacity:g}"/>'
    dash = f' stroke-dasharray="{" ".join(f"{d:g}" for d in line.dash)}"' if line.dash else ""
    faint = f' stroke-opacity="{line.opacity:g}"' if line.opacity < 1 else ""
    return (
        f'<path d="{path}" fill="none" stroke="{_hex(line.colour)}" stroke-width="{line.width:g}" '
        f'stroke-linejoin="round"{dash}{faint}/>'
    )


def _text(text: Text) -> str:
    turned = f' transform="rotate(-90 {text.x:.2f} {text.y:.2f})"' if text.turned else ""
    bold = ' font-weight="bold"' if text.bold else ""
    return (
        f'<text x="{text.x:.2f}" y="{text.y:.2f}" font-size="{text.size:g}" text-anchor="{text.anchor}" '
        f'fill="{_hex(text.colour)}"{bold}{turned}>{escape(text.text)}</text>'
    )


def _hex(colour: Colour) -> str:
    return "#" + "".join(f"{round(255 * c):02x}" for c in colour)
