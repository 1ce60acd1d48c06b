"""The command ``meltemi docs``: the documentation in the browser, from a clone of the repository."""

from __future__ import annotations

import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from meltemi.app.terminal import folder_for, say
from meltemi.core.errors import InputError

if TYPE_CHECKING:
    from http.server import ThreadingHTTPServer


def docs(
    browser: Annotated[bool, "Open the page in the browser."] = True,
    out: Annotated[Path | None, "Folder for the pages [the user's cache]."] = None,
) -> None:
    """Show the documentation in the browser until Ctrl-C; builds it first where its sources are newer."""
    folder = clone()
    with page_server(built_site(folder, out or site_of(folder))) as server:
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


def site_of(clone: Path) -> Path:
    """Folder for the pages of a clone in the user's cache: nothing is written into the clone."""
    from hashlib import sha256

    from platformdirs import user_cache_path

    return user_cache_path("meltemi") / f"docs-{sha256(str(clone.resolve()).encode()).hexdigest()[:16]}"


def built_site(folder: Path, site: Path) -> Path:
    """The site of a clone; it is built if pages, docstrings or the scripts of the view are newer.

    Args:
      folder: the clone.
      site: folder for the pages; a folder with other files is refused.

    Raises:
      InputError: mkdocs is not installed, or fails, or the pages cannot be written.
    """
    site = site.absolute()
    part = site.with_name(f"{site.name}.part")
    made_of = ("docs/**/*", "tools/*.py", *(f"src/**/*.{kind}" for kind in ("py", "js", "css", "html")))
    sources = (folder / "mkdocs.yml", *(path for pattern in made_of for path in folder.glob(pattern)))
    index = site / "index.html"
    if index.is_file() and index.stat().st_mtime >= max(path.stat().st_mtime for path in sources):
        return site
    if find_spec("material") is None or find_spec("mkdocstrings") is None:
        raise InputError(f'docs: mkdocs is not installed; in {folder} run: pip install -e ".[docs]"')
    if site.exists() and not index.is_file() and (not site.is_dir() or any(site.iterdir())):
        raise InputError(f"docs: --out {site}: has other files; give a new or empty folder")
    folder_for(site.parent)
    say("building the documentation ...")
    try:
        command = [sys.executable, "-m", "mkdocs", "build", "--quiet", "--site-dir", str(part)]
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
