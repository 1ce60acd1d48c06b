"""The command ``meltemi docs``: the documentation in the browser, from a clone of the repository."""

from __future__ import annotations

import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from meltemi.app.terminal import say
from meltemi.core.errors import InputError

if TYPE_CHECKING:
    from http.server import ThreadingHTTPServer


def docs(
    browser: Annotated[bool, typer.Option("--browser/--no-browser", help="Open the page in the browser.")] = True,
) -> None:
    """Show the documentation in the browser until Ctrl-C; builds it first where its sources are newer."""
    with page_server(built_site(clone())) as server:
        address = f"http://127.0.0.1:{server.server_port}/"
        print(f"{address} (Ctrl-C ends)", flush=True)
        if browser:
            import webbrowser

            webbrowser.open(address)
        try:
            server.serve_forever()
        except KeyboardInterrupt:
            print()


def clone() -> Path:
    """The clone of the repository: the current folder, or that of an editable installation.

    Raises:
      InputError: neither is one.
    """
    for folder in (Path.cwd(), Path(__file__).parents[3]):
        if (folder / "mkdocs.yml").is_file() and (folder / "docs" / "getting-started.md").is_file():
            return folder
    raise InputError("docs: the installed package does not contain the pages; run it in a clone of the repository")


def built_site(folder: Path) -> Path:
    """The site of a clone; it is built if pages, docstrings or the scripts of the view are newer.

    Raises:
      InputError: mkdocs is not installed, or fails.
    """
    site, part = folder / "site", folder / "site.part"
    made_of = ("docs/**/*", "tools/*.py", *(f"src/**/*.{kind}" for kind in ("py", "js", "css", "html")))
    sources = (folder / "mkdocs.yml", *(path for pattern in made_of for path in folder.glob(pattern)))
    index = site / "index.html"
    if index.is_file() and index.stat().st_mtime >= max(path.stat().st_mtime for path in sources):
        return site
    if find_spec("material") is None or find_spec("mkdocstrings") is None:
        raise InputError(f'docs: mkdocs is not installed; in {folder} run: pip install -e ".[docs]"')
    say("building the documentation ...")
    try:
        command = [sys.executable, "-m", "mkdocs", "build", "--quiet", "--site-dir", part.name]
        ran = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
        if ran.returncode:
            raise InputError(f"docs: mkdocs failed: {(ran.stderr.strip() or 'no message').splitlines()[-1]}")
        shutil.rmtree(site, ignore_errors=True)
        part.rename(site)
    finally:
        shutil.rmtree(part, ignore_errors=True)
    return site


def page_server(site: Path) -> ThreadingHTTPServer:
    """A server of the pages for this computer only, which logs no requests."""
    from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer

    class Pages(SimpleHTTPRequestHandler):
        def __init__(self, *arguments: Any) -> None:
            super().__init__(*arguments, directory=str(site))

        def log_message(self, *_: Any) -> None: ...

    return ThreadingHTTPServer(("127.0.0.1", 0), Pages)
