"""The documentation as pages for a browser, for the zip: what Blender's "Online Manual" and our "?" buttons open.

Knows the Markdown that docs/ is written in: headings, paragraphs, lists, tables, code, emphasis, links, pictures.
"""

import html
import re
import shutil
from pathlib import Path

STYLE = """:root { color-scheme: light dark } body { font: 16px/1.5 system-ui, sans-serif; max-width: 60rem;
margin: 2rem auto; padding: 0 1rem } img { max-width: 100% } table { border-collapse: collapse; display: block;
overflow-x: auto } th, td { text-align: left; vertical-align: top; padding: .2rem .6rem;
border-bottom: 1px solid #8886 } pre { overflow-x: auto; padding: .6rem; background: #8882 } nav { font-size: .9rem }"""
LEFT_OUT = ("benchmark",)
"""Folders of docs/ that hold figures for whoever develops this."""


def anchor(heading: str) -> str:
    """The anchor that links to a heading, as code forges make it."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).strip().replace(" ", "-")


def write_pages(docs: Path, out: Path) -> None:
    """Write a page for each Markdown file of `docs` into the new folder `out`, with the pictures that they show."""
    out.mkdir(parents=True)
    names = sorted(docs.glob("*.md"))
    links = " &middot; ".join(
        f'<a href="{name.stem}.html">{name.stem.replace("_", " ").replace("-", " ")}</a>' for name in names
    )
    for path in names:
        body = page(path.read_text(encoding="utf-8"))
        (out / f"{path.stem}.html").write_text(
            f'<!doctype html><html lang="en"><meta charset="utf-8"><title>Scan Relight: {path.stem}</title>'
            f"<style>{STYLE}</style><nav>{links}</nav>{body}</html>\n",
            encoding="utf-8",
        )
    for path in (*docs.rglob("*.png"), *docs.rglob("*.jpg")):
        relative = path.relative_to(docs)
        if relative.parts[0] not in LEFT_OUT:
            (out / relative).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(path, out / relative)


def page(text: str) -> str:
    blocks, lines = [], text.splitlines()
    at = 0
    while at < len(lines):
        line, begin = lines[at], at
        if line.startswith("```"):
            at = next((k for k in range(at + 1, len(lines)) if lines[k].startswith("```")), len(lines)) + 1
            blocks.append(f"<pre>{html.escape(chr(10).join(lines[begin + 1 : at - 1]))}</pre>")
        elif line.startswith("    "):
            while at < len(lines) and (lines[at].startswith("    ") or not lines[at].strip()):
                at += 1
            blocks.append(f"<pre>{html.escape(chr(10).join(row[4:] for row in lines[begin:at]).rstrip())}</pre>")
        elif heading := re.match(r"(#+) (.*)", line):
            level = len(heading[1])
            blocks.append(f'<h{level} id="{anchor(heading[2])}">{inline(heading[2])}</h{level}>')
            at += 1
        elif line.startswith("|"):
            while at < len(lines) and lines[at].startswith("|"):
                at += 1
            blocks.append(table(lines[begin:at]))
        elif item := re.match(r"(-|\d+\.) ", line):
            while at < len(lines) and lines[at].strip():
                at += 1
            kind = "ul" if item[1] == "-" else "ol"
            items = re.split(r"\n(?:-|\d+\.) +", "\n" + "\n".join(lines[begin:at]))[1:]
            blocks.append(f"<{kind}>{''.join(f'<li>{inline(entry)}</li>' for entry in items)}</{kind}>")
        elif line.strip():
            while at < len(lines) and lines[at].strip() and not lines[at].startswith(("#", "|", "```")):
                at += 1
            blocks.append(f"<p>{inline(chr(10).join(lines[begin:at]))}</p>")
        else:
            at += 1
    return "\n".join(blocks)


def table(lines: list[str]) -> str:
    """A table; its second line only marks the first as its head."""
    rows = [[inline(cell.strip()) for cell in re.split(r"(?<!\\)\|", line.strip().strip("|"))] for line in lines]
    head, body = rows[0], rows[2:]
    cells = ["".join(f"<th>{cell}</th>" for cell in head)]
    cells += ["".join(f"<td>{cell}</td>" for cell in row) for row in body]
    return f"<table>{''.join(f'<tr>{row}</tr>' for row in cells)}</table>"


def inline(text: str) -> str:
    """The markup within a paragraph, as HTML."""
    code: list[str] = []

    def keep(match):
        code.append(f"<code>{match[1]}</code>")
        return f"\0{len(code) - 1}\0"

    text = re.sub(r"`([^`]+)`", keep, html.escape(text, quote=False))
    text = re.sub(r"!\[([^\]]*)\]\(([^)]+)\)", r'<img alt="\1" src="\2">', text)
    text = re.sub(r"\[([^\]]+)\]\(([^)]+)\)", lambda m: f'<a href="{address(m[2])}">{m[1]}</a>', text)
    text = re.sub(r"\*\*(.+?)\*\*", r"<b>\1</b>", text, flags=re.DOTALL)
    text = re.sub(r"(?<![\w*])\*(?!\s)([^*]+?)\*(?![\w*])", r"<i>\1</i>", text, flags=re.DOTALL)
    return re.sub(r"\0(\d+)\0", lambda m: code[int(m[1])], text)


def address(link: str) -> str:
    """A link between the documents as one between their pages."""
    return re.sub(r"^([\w-]+)\.md(?=#|$)", r"\1.html", link)
