"""Flamenco: the job type's script as a manager runs it, and what is sent to one, by its recorded schema."""

from __future__ import annotations

import json
import shutil
import subprocess
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest

from addon import cli
from addon.core.pipeline.stages import STAGES
from addon.farm.flamenco import SCRIPT, job_of
from addon.farm.plan import Room

HERE = Path(__file__).parent
SCHEMA = json.loads((HERE / "flamenco_schema.json").read_text())
KINDS = {"string": str, "integer": int, "object": dict, "array": list, "boolean": bool, "any": object}
DIVIDED = tuple(one.name for one in STAGES if one.divided_by)


def assert_fits(value: dict, name: str) -> None:
    """A value has what the manager's interface asks for, and nothing that it does not know."""
    schema = SCHEMA[name]
    assert set(schema["required"]) <= set(value) <= set(schema["properties"]), name
    for key, kind in schema["properties"].items():
        if key in value and kind == "strings":
            assert all(isinstance(one, str) for one in value[key].values())
        elif key in value and isinstance(kind, list):
            assert value[key] in kind
        elif key in value:
            assert isinstance(value[key], KINDS[kind]), key


def compiled(job: dict) -> dict:
    """What the script makes of a job."""
    node = shutil.which("node") or shutil.which("nodejs")
    if node is None:
        pytest.skip("NO JAVASCRIPT ENGINE (node) HERE: FLAMENCO'S JOB TYPE IS NOT TESTED")
    told = json.dumps({"script": SCRIPT.read_text(), "job": job})
    done = subprocess.run([node, HERE / "flamenco_manager.js"], input=told, capture_output=True, text=True, check=True)
    return json.loads(done.stdout)


def room(**how) -> Room:
    return Room(Path("/shared/rooms/kitchen"), Path("/shared/results/my kitchen"), divided=DIVIDED, **how)


def test_the_job_type_is_one():
    found = compiled({"settings": {"capture": "/c", "result": "/r"}})["job_type"]
    assert_fits(found | {"name": "scan-relight", "etag": ""}, "AvailableJobType")
    for setting in found["settings"]:
        assert_fits(setting, "AvailableJobSetting")
        assert "default" not in setting or isinstance(setting["default"], {"int32": int}.get(setting["type"], str))


@pytest.mark.parametrize("blocks", [1, 3])
def test_a_job_becomes_the_plans_units_with_their_commands(blocks):
    options = ("--preset=draft", "--no-scene", "--convention=odd words", "--mesh=/shared/other mesh.ply")
    one = room(blocks=blocks, program=("{python}", "-m", "scan relight"), options=options)
    job = job_of(one)
    tasks = compiled(job)["tasks"]
    plan = one.tasks()
    assert [(task["name"], tuple(task["after"])) for task in tasks] == [(task.name, task.after) for task in plan]
    parser = cli.make_parser()
    for task, unit in zip(tasks, plan, strict=True):
        assert task["type"] == "misc"
        [command] = task["commands"]
        assert_fits(command, "Command")
        assert command["name"] == "exec" and command["parameters"]["exe"] == "{python}"
        words = command["parameters"]["args"]
        block = "{}/{}".format(*unit.block) if unit.block else ""
        wanted = one.command(unit.stage, block)[1:]
        assert words[:2] == wanted[:2]
        assert vars(parser.parse_args(words[2:])) == vars(parser.parse_args(wanted[2:]))
        assert str(one.capture) in words and "/shared/other mesh.ply" in words  # whole words: variables fit in


def test_words_as_somebody_types_them():
    job = {"settings": {"capture": "/c", "result": "/r", "options": "  --preset=draft   --no-scene "}}
    command = compiled(job)["tasks"][0]["commands"][0]["parameters"]
    assert command == {
        "exe": "{scan_relight}",
        "args": ["stage", "/c", "--out", "/r", "--stage", "surface", "--preset=draft", "--no-scene"],
    }


@pytest.mark.parametrize("settings", [{}, {"capture": "/c"}, {"capture": "/c", "result": "/r", "blocks": -1}])
def test_what_is_no_job_is_refused(settings):
    found = compiled({"settings": settings})
    assert found["error"] and not found["tasks"]


class Recorded(BaseHTTPRequestHandler):
    """Answers as a manager does."""

    known = True
    etag = "abc"
    jobs: list[dict] = []
    refuses = ""
    nonsense = False

    def log_message(self, *_):
        pass

    def answer(self, code: int, content: dict) -> None:
        text = b"<html>" if self.nonsense else json.dumps(content).encode()
        self.send_response(code)
        self.send_header("Content-Length", str(len(text)))
        self.end_headers()
        self.wfile.write(text)

    def do_GET(self):
        if self.path != "/api/v3/jobs/type/scan-relight" or not self.known:
            return self.answer(404, {"code": 404, "message": "job type not found"})
        self.answer(200, {"name": "scan-relight", "label": "x", "settings": [], "etag": self.etag})

    def do_POST(self):
        job = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
        assert self.path == "/api/v3/jobs" and self.headers["Content-Type"] == "application/json"
        if self.refuses:
            return self.answer(412, {"code": 412, "message": self.refuses})
        self.jobs.append(job)
        self.answer(200, job | {"id": f"job-{len(self.jobs)}", "status": "queued"})


@pytest.fixture
def manager():
    """A manager's class, whose `address` it listens at."""
    kind = type("Manager", (Recorded,), {"jobs": []})
    server = ThreadingHTTPServer(("127.0.0.1", 0), kind)
    thread = threading.Thread(target=server.serve_forever, args=(0.02,))
    thread.start()
    kind.address = f"http://127.0.0.1:{server.server_port}"
    yield kind
    server.shutdown()
    thread.join()
    server.server_close()


@pytest.fixture
def submitted(tmp_path):
    """Submits two rooms; the exit code."""
    for name in ("one", "two"):
        (tmp_path / name).mkdir()

    def submit(address: str) -> int:
        rooms = [str(tmp_path / name) for name in ("one", "two")]
        how = ["--engine", "flamenco", "--manager", address, "--out", str(tmp_path / "results"), "--no-scene"]
        return cli.main(["submit", *how, *rooms])

    return submit


def test_rooms_are_jobs(manager, submitted, tmp_path, capsys):
    assert submitted(manager.address) == 0
    assert capsys.readouterr().out.splitlines() == ["one: job job-1", "two: job job-2"]
    for job, name in zip(manager.jobs, ("one", "two"), strict=True):
        assert_fits(job, "SubmittedJob")
        assert job["type_etag"] == "abc" and job["name"] == name
        assert job["settings"]["result"] == str(tmp_path / "results" / name)
        assert compiled(job)["error"] is None


@pytest.mark.parametrize(
    ("state", "told"),
    [
        ({"known": False}, "has no job type 'scan-relight'"),
        ({"refuses": "job type etag does not match"}, "refused (412): job type etag does not match."),
        ({"nonsense": True}, "is no manager of Flamenco 3"),
    ],
)
def test_what_a_manager_refuses_is_told(manager, submitted, capsys, state, told):
    for name, value in state.items():
        setattr(manager, name, value)
    assert submitted(manager.address) == 2
    err = capsys.readouterr().err
    assert err.count(told) == 2 and err.count("\n") == 2 and not manager.jobs


@pytest.mark.parametrize("address", ["http://127.0.0.1:1", "file:///etc/passwd", "nonsense", "http://[", "http://a b"])
def test_an_address_without_a_manager_is_told(submitted, capsys, address):
    assert submitted(address) == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 2 and "Traceback" not in err and "anager" in err
