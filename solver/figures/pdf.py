"""A page as PDF 1.4: vectors, and text in Helvetica, which every reader has."""

from __future__ import annotations

import zlib

from markerscope.solver.figures.drawing import Line, Page, Text, pieces, text_width


def pdf(page: Page) -> bytes:
    """The bytes of a PDF file of one page."""
    shades: list[float] = []
    body = "\n".join(_line(item, page, shades) if isinstance(item, Line) else _text(item, page) for item in page.items)
    packed = zlib.compress(body.encode("cp1252", errors="replace"))
    states = " ".join(f"/G{i} << /ca {value:g} /CA {value:g} >>" for i, value in enumerate(shades))
    fonts = " ".join(
        f"/{key} << /Type /Font /Subtype /Type1 /BaseFont /{name} /Encoding /WinAnsiEncoding >>"
        for key, name in (("F1", "Helvetica"), ("F2", "Helvetica-Bold"))
    )
    resources = f"<< /Font << {fonts} >> /ExtGState << {states} >> >>"
    box = f"[0 0 {page.width:g} {page.height:g}]"
    objects = [
        b"<< /Type /Catalog /Pages 2 0 R >>",
        b"<< /Type /Pages /Kids [3 0 R] /Count 1 >>",
        f"<< /Type /Page /Parent 2 0 R /MediaBox {box} /Resources {resources} /Contents 4 0 R >>".encode("ascii"),
        f"<< /Length {len(packed)} /Filter /FlateDecode >>\nstream\n".encode("ascii") + packed + b"\nendstream",
        b"<< /Title (" + _escaped(page.title).encode("cp1252", errors="replace") + b") /Producer (Markerscope) >>",
    ]
    out, places = b"%PDF-1.4\n%\xe2\xe3\xcf\xd3\n", []
    for number, content in enumerate(objects, 1):
        places.append(len(out))
        out += f"{number} 0 obj\n".encode("ascii") + content + b"\nendobj\n"
    table = "".join(f"{place:010d} 00000 n \n" for place in places)
    count = len(objects) + 1
    tail = f"xref\n0 {count}\n0000000000 65535 f \n{table}trailer\n<< /Size {count} /Root 1 0 R /Info 5 0 R >>\n"
    return out + f"{tail}startxref\n{len(out)}\n%%EOF\n".encode("ascii")


def _line(line: Line, page: Page, shades: list[float]) -> str:
    parts = pieces(line.points)
    if not parts:
        return ""
    if line.opacity not in shades:
        shades.append(line.opacity)
    path = " ".join(
        " ".join(f"{x:.2f} {page.height - y:.2f} {'l' if i else 'm'}" for i, (x, y) in enumerate(piece))
        for piece in parts
    )
    state = f"q /G{shades.index(line.opacity)} gs"
    if line.fill is not None:
        return f"{state} {_rgb(line.fill)} rg {path} h f Q"
    dash = f"[{' '.join(f'{d:g}' for d in line.dash)}] 0 d"
    return f"{state} {_rgb(line.colour)} RG {line.width:g} w 1 j {dash} {path} S Q"


def _text(text: Text, page: Page) -> str:
    shift = {"start": 0.0, "middle": 0.5, "end": 1.0}[text.anchor] * text_width(text.text, text.size)
    x, y = (text.x, text.y + shift) if text.turned else (text.x - shift, text.y)
    turn = "0 1 -1 0" if text.turned else "1 0 0 1"
    font = "F2" if text.bold else "F1"
    place = f"{turn} {x:.2f} {page.height - y:.2f} Tm"
    return f"BT {_rgb(text.colour)} rg /{font} {text.size:g} Tf {place} ({_escaped(text.text)}) Tj ET"


def _rgb(colour: tuple[float, float, float]) -> str:
    return " ".join(f"{c:.3f}" for c in colour)


def _escaped(text: str) -> str:
    return text.replace("\\", "\\\\").replace("(", "\\(").replace(")", "\\)")
