"""``meltemi docs`` shows the pages of a clone, and says what to do where there is none."""

from __future__ import annotations

import os
import subprocess
import threading
import urllib.request
import webbrowser
from http.server import ThreadingHTTPServer
from pathlib import Path

import pytest
from terminal import Command

from meltemi.app import docs


@pytest.fixture
def clone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder like the repository, with a site that is newer than its pages."""
    (tmp_path / "docs").mkdir()
    (tmp_path / "site").mkdir()
    monkeypatch.setattr(docs, "site_of", lambda clone: tmp_path / "site")
    for name in ("mkdocs.yml", "docs/getting-started.md", "site/index.html"):
        (tmp_path / name).write_text(f"text of {name}", encoding="utf-8")
    os.utime(tmp_path / "mkdocs.yml", (1e9, 1e9))
    os.utime(tmp_path / "docs" / "getting-started.md", (1e9, 1e9))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_pages_are_served_and_opened(command: Command, clone: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pages = []

    def visit(address: str) -> None:
        def read() -> None:
            with urllib.request.urlopen(address, timeout=20) as page:
                pages.append(page.read().decode())

        threads.append(threading.Thread(target=read))
        threads[0].start()

    def serve(server: ThreadingHTTPServer) -> None:
        server.handle_request()
        raise KeyboardInterrupt

    threads: list[threading.Thread] = []
    monkeypatch.setattr(webbrowser, "open", visit)
    monkeypatch.setattr(ThreadingHTTPServer, "serve_forever", serve)
    ran = command("docs")
    threads[0].join()
    assert ran.status == 0 and ran.out.startswith("http://127.0.0.1:")
    assert pages == ["text of site/index.html"]


def test_newer_pages_are_built_anew(clone: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A build that fails leaves the site as it was."""
    status = 1

    def build(arguments: list[str], cwd: Path, **_: object) -> subprocess.CompletedProcess[str]:
        Path(arguments[-1]).mkdir()
        (Path(arguments[-1]) / "index.html").write_text("newer", encoding="utf-8")
        return subprocess.CompletedProcess(arguments, status, "", "first line\nERROR - a broken link")

    monkeypatch.setattr(subprocess, "run", build)
    monkeypatch.setattr(docs, "find_spec", lambda name: name)
    site = clone / "site"
    assert docs.built_site(clone, site) == site
    os.utime(clone / "docs" / "getting-started.md", (4e9, 4e9))
    with pytest.raises(docs.InputError, match="mkdocs failed: ERROR - a broken link"):
        docs.built_site(clone, site)
    assert (clone / "site" / "index.html").read_text() == "text of site/index.html"
    status = 0
    docs.built_site(clone, site)
    assert (clone / "site" / "index.html").read_text() == "newer" and not (clone / "site.part").exists()


def test_what_is_missing_is_named(command: Command, clone: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (clone / "site" / "index.html").unlink()
    monkeypatch.setattr(docs, "find_spec", lambda name: None)
    ran = command("docs")
    assert ran.status == 2 and 'pip install -e ".[docs]"' in ran.err
    monkeypatch.setattr(docs, "__file__", str(clone / "a" / "b" / "c" / "d"))
    (clone / "mkdocs.yml").unlink()
    ran = command("docs")
    assert ran.status == 2 and "run it in a clone of the repository" in ran.err


def test_nothing_is_written_into_the_clone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The pages are built in a folder of the user's cache, one for each clone, or in one that is chosen and empty."""
    (tmp_path / "docs").mkdir()
    for name in ("mkdocs.yml", "docs/getting-started.md"):
        (tmp_path / name).touch()
    places = [docs.site_of(folder) for folder in (tmp_path, tmp_path / "docs")]
    assert len(set(places)) == 2 and not any(place.is_relative_to(tmp_path) for place in places)
    monkeypatch.setattr(docs, "find_spec", lambda name: name)
    with pytest.raises(docs.InputError, match="has other files; give a new or empty folder"):
        docs.built_site(tmp_path, tmp_path / "docs")
