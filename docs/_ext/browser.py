"""The script of the page docs/browser.md."""

from pathlib import Path

from jointlaw.hosts.browser import export


def add(app, failed):
    """Write the script into the static files of a site whose build succeeded."""
    if failed is None and app.builder.format == "html":
        script = Path(app.outdir) / "_static" / "joint.js"
        script.write_text(export.script(), encoding="utf-8")


def setup(app):
    app.connect("build-finished", add)
    return {"parallel_read_safe": True}
