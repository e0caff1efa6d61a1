from __future__ import annotations

import compileall
import gc
import os
import random
import shutil
import subprocess
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

# Before NumPy is loaded, here and in what tests start: there is a process for each processor, and threads that wait for
# work turn in circles, which takes as much time as the work.
os.environ |= dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")

import pytest
from command_line import Ran, Run
from hypothesis import HealthCheck, settings
from pages import Chromium, Tabs

import motionmind
from motionmind.cli import main
from motionmind.cli.warming import FIRST_RUN_NOTE
from motionmind.codecache import is_all_compiled
from motionmind.corpus import cache as cache_of_corpora
from motionmind.discretize.codebook import Codebook
from motionmind.formats import read_motion
from motionmind.retarget.retarget import own_skeleton
from motionmind.tween.engine import Engine

# Python looks for garbage after every 700 new objects: 7% of the time of tests of scores and tweens. This leaves 2%.
gc.set_threshold(20_000)

# The same examples on every run and every machine, and no failure because a machine was slow.
settings.register_profile(
    "motionmind",
    derandomize=True,
    deadline=None,
    print_blob=False,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture],
)
settings.load_profile("motionmind")

# The first one shows the same pages with no window around them: tests of cells took an eighth less time with it.
_CHROMIUM = ("chromium-headless-shell", "chromium", "chromium-browser", "google-chrome")
# Drawing in software takes most of the time of a page's tests: only canvases are drawn by WebGL, not the page around.
_FLAGS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-gpu-compositing"]
# Each window would load two pages for what drops from the address bar, and start a process for a page to come: half of
# what it costs to open a page. The others are those that Playwright switches off, whose list this one replaces.
_FEATURES = ["WebUIOmniboxPopup", "WebUIOmniboxAimPopup", "SpareRendererForSitePerProcess"]
_FEATURES += ["AvoidUnnecessaryBeforeUnloadCheckSync", "DestroyProfileOnBrowserClose", "HttpsUpgrades", "LensOverlay"]
_FEATURES += ["MediaRouter", "PaintHolding", "ThirdPartyStoragePartitioning", "OptimizationHints", "AimEnabled"]
_FEATURES += ["HttpsFirstBalancedModeAutoEnable", "AvoidCorsURLLoaderRestartOnRedirect", "NetworkTimeServiceQuerying"]
_FLAGS.append(f"--disable-features={','.join([*_FEATURES, 'PreconnectToSearch'])}")
TESTS = Path(__file__).parent
SHARED_DATA = TESTS.parents[1] / "shared" / "data"


def _runs_all(config: pytest.Config) -> bool:
    """Return whether all tests were asked for, rather than some files or folders."""
    asked = {(config.invocation_params.dir / argument).resolve() for argument in config.args}
    return not asked.isdisjoint({TESTS, TESTS.parent})


def pytest_configure(config: pytest.Config) -> None:
    """Leave the long tests out of `pytest` alone: they run by their mark, or if their file is named."""
    if _runs_all(config) and not config.option.markexpr:
        config.option.markexpr = "not long"


def pytest_sessionstart(session: pytest.Session) -> None:
    """Compile before all tests what each worker, or each process that a test starts, would else compile for itself.

    These are the inner loops, which workers would come to at the same moment, the bytecode of the package, which an
    environment may keep Python from writing, and what pytest makes of the tests' assertions, which takes a worker half
    the time in which it collects them. A few tests compile what they need.
    """
    config = session.config
    is_worker, only_lists = hasattr(config, "workerinput"), config.option.collectonly
    if not _runs_all(config) or only_lists:
        return
    sys.dont_write_bytecode = False  # of tests that have changed, for the next time
    if is_worker:
        return
    compileall.compile_dir(Path(motionmind.__file__).parent, quiet=1)
    if not is_all_compiled():
        config.pluginmanager.getplugin("terminalreporter").write_line("compiling, which takes a minute or two")
        collect = [sys.executable, "-m", "pytest", "--collect-only", "-qq", "-o", "addopts=", str(TESTS)]
        environment = os.environ | {"PYTHONDONTWRITEBYTECODE": ""}
        with subprocess.Popen(collect, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL):
            subprocess.run([sys.executable, "-m", "motionmind", "warm"], capture_output=True, check=False)


def pytest_xdist_auto_num_workers() -> int:
    """Start half as many workers again as there are processors, for tests of pages wait half of their time."""
    processors = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return processors + (processors + 1) // 2


def _shows_pages(item: pytest.Item) -> bool:
    return "browser" in getattr(item, "fixturenames", ())


@pytest.hookimpl(trylast=True)  # when the order is a random one
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Let workers begin with the files that wait for pages, and go on with those of most tests: they end together."""
    if hasattr(config, "workerinput"):
        sizes = Counter(item.path for item in items)
        pages = {item.path for item in items if _shows_pages(item)}
        items.sort(key=lambda item: (item.path not in pages, -sizes[item.path]))


@cache
def _chromium() -> Chromium:
    pytest.importorskip("playwright", reason="Playwright is not installed")
    path = next(filter(None, map(shutil.which, _CHROMIUM)), None)
    if path is None:
        pytest.skip("no Chromium is installed")
    return Chromium(path, _FLAGS)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_teardown(nextitem: pytest.Item | None) -> Iterator[None]:
    """Close the browser after tests of pages: Playwright's event loop would be in the way of tests that run one."""
    yield
    if _chromium.cache_info().currsize and (nextitem is None or not _shows_pages(nextitem)):
        _chromium().close()


def pytest_collection_finish() -> None:
    """Keep eight thousand tests and what they import out of each search for garbage, a twentieth of all tests' time."""
    gc.freeze()


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The folder of recorded movement that lies beside the checkout; it may not be part of it."""
    if not SHARED_DATA.is_dir():
        pytest.skip(f"recorded movement is not here: no folder {SHARED_DATA}")
    return SHARED_DATA


@pytest.fixture(scope="session")
def cmu05(shared_data: Path) -> Engine:
    """What is learned from twenty clips of one dancer, at 5 Hz and 15 degrees; each begins with an added T-pose."""
    clips = [own_skeleton(read_motion(path)) for path in sorted((shared_data / "cmu-05").glob("*.bvh"))]
    if not clips:
        pytest.skip(f"no clips in {shared_data / 'cmu-05'}")
    return Engine.fit(clips, rate=5.0, skip=1, facing="free", discretization=Codebook(15.0))


@pytest.fixture
def empty_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A cache of the test's own for corpora, what is learned from them, and archives."""
    monkeypatch.setattr(cache_of_corpora, "cache_folder", lambda room: tmp_path / "cache" / room)
    return tmp_path / "cache"


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    """The command line in this process, in an empty folder, with a home of its own.

    Whichever test searches first has the inner loops compiled; the line that says so is left out of what was printed.
    """
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MOTIONMIND_HOME", str(tmp_path / "home"))

    def call(*arguments: object) -> Ran:
        with pytest.raises(SystemExit) as end:
            main([str(argument) for argument in arguments])
        captured = capsys.readouterr()
        assert isinstance(end.value.code, int)
        return Ran(end.value.code, captured.out, captured.err.replace(f"{FIRST_RUN_NOTE}\n", ""))

    return call


@pytest.fixture
def browser() -> Any:
    """Chromium, with WebGL though there be no GPU."""
    return _chromium().browser


@pytest.fixture
def tabs(browser: Any) -> Tabs:
    """Tabs of Chromium, in which WebGL draws only where that is asked for."""
    return _chromium().tabs


_BAD = ["nan", "1e999", "1e300", "-", "{", "}", "[", "9" * 30, "End", "\0", "é", ":", ";", ",", "#", '"', "_", "0"]
_BAD += ["null", "\x85", "\x1c", "\u0661", "1\u20282"]


def _mutate(text: str, rng: random.Random) -> bytes:
    """`text` with some words or bytes deleted, doubled, swapped, replaced, or cut off."""
    words = text.replace("\n", " \n ").split(" ")
    for _ in range(rng.randint(1, 3)):
        at, other = rng.randrange(len(words)), rng.randrange(len(words))
        match rng.randrange(5):
            case 0:
                del words[at]
            case 1:
                words.insert(at, words[other])
            case 2:
                words[at], words[other] = words[other], words[at]
            case 3:
                words[at] = rng.choice(_BAD)
            case 4:
                words = words[: max(2, at)]
    data = bytearray(" ".join(words).encode())
    for _ in range(rng.randint(0, 2)):
        at = rng.randrange(len(data) + 1)
        data[at : at + rng.randint(0, 3)] = rng.randbytes(rng.randint(0, 2))
    return bytes(data)


@pytest.fixture(scope="session")
def mutate() -> Callable[[str, random.Random], bytes]:
    """A function that damages a text, a little, at random."""
    return _mutate
