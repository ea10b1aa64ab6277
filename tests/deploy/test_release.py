"""What is said of a version that others install: what it is made of, what is known against it."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests.deploy.test_image import locked_by_hash

TOP = Path(__file__).parents[2]
LOCK = TOP / "deploy" / "image.lock"
pytestmark = pytest.mark.nightly


def test_the_bill_of_materials_names_what_an_image_gets() -> None:
    subprocess.run(["make", "sbom"], cwd=TOP, check=True, capture_output=True)
    bill = json.loads((TOP / "dist" / "quadriga.cdx.json").read_text(encoding="utf-8"))
    assert bill["bomFormat"] == "CycloneDX"
    assert bill["metadata"]["component"]["name"] == "quadriga"
    named = {item["name"]: item["version"] for item in bill["components"]}
    assert named == {name: version for name, (version, _) in locked_by_hash().items()}


def test_nothing_is_known_against_what_an_image_gets() -> None:
    """If there is: `make image-lock` with a later version of it."""
    audit = [sys.executable, "-m", "pip_audit", "--requirement", str(LOCK), "--disable-pip"]
    options = ["--format", "json", "--progress-spinner", "off", "--timeout", "10"]
    done = subprocess.run([*audit, *options], capture_output=True, text=True, check=False)
    assert done.stdout or "ConnectionError" in done.stderr, done.stderr
    rows = json.loads(done.stdout)["dependencies"] if done.stdout else []
    looked_up = [row for row in rows if "skip_reason" not in row]
    if not looked_up:
        pytest.skip("no advisories without the package index: nothing was audited")
    assert {row["name"]: row["vulns"] for row in looked_up if row["vulns"]} == {}
    assert len(looked_up) == len(locked_by_hash())
