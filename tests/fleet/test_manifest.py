"""The manifest of KubeRay agrees with the job of the how-to and with what is pinned."""

import re
from pathlib import Path

import yaml

from tumble.fleet.job import load_job

ROOT = Path(__file__).parent.parent.parent


def test_manifest_gives_the_job_of_the_how_to_on_the_pinned_ray(tmp_path):
    settings, job = yaml.safe_load_all((ROOT / "deploy" / "kuberay.yaml").read_text())
    page = (ROOT / "docs" / "how-to" / "fleet.md").read_text()
    [stated] = re.findall(r"```yaml\n(.*?)```", page, re.DOTALL)
    assert settings["data"]["job.yaml"] == stated
    (tmp_path / "job.yaml").write_text(stated)
    assert load_job(tmp_path / "job.yaml").procedure == "spin"
    pinned = (ROOT / "requirements" / "test.txt").read_text()
    version = job["spec"]["rayClusterSpec"]["rayVersion"]
    assert re.search(rf"^ray(\[[\w,]+\])?=={re.escape(version)} ", pinned, re.MULTILINE)
