"""The page "A joint in your browser": the script that it loads."""

from pathlib import Path

from jointlaw.hosts.browser import export


def add(app, failed):
    """Put it beside the pages of a site that was built."""
    if failed is None and app.builder.format == "html":
        script = Path(app.outdir) / "_static" / "joint.js"
        script.write_text(export.script(), encoding="utf-8")


def setup(app):
    app.connect("build-finished", add)
    return {"parallel_read_safe": True}
