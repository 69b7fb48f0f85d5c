"""Laws of all tests, and the settings of Hypothesis."""

import hypothesis
import kinds
import pytest

from jointlaw.support.pyplot import STYLE

RESOLUTION = STYLE["savefig.dpi"]

# Derandomized: the same cases on every machine, so that a failure is a change of the code.
hypothesis.settings.register_profile(
    "jointlaw", deadline=None, max_examples=40, derandomize=True, database=None
)
hypothesis.settings.load_profile("jointlaw")


@pytest.fixture(scope="session")
def make_law():
    """A function: smooth Westerly granite at the coarsest resolution, with changed parameters."""
    return kinds.make_law


@pytest.fixture(scope="session")
def law():
    """Smooth Westerly granite at the coarsest resolution."""
    return kinds.make_law()


@pytest.fixture(scope="session", params=kinds.LAWS)
def any_law(request):
    """One law of each kind of joint."""
    return kinds.LAWS[request.param]


@pytest.fixture(scope="session", params=[k for k, law in kinds.LAWS.items() if law.dim > 1])
def any_sheared_law(request):
    """One law of each kind that can shear."""
    return kinds.LAWS[request.param]


@pytest.fixture
def moved(law):
    """A batch of five joints, each somewhere else on its path."""
    batch = law.joints(5)
    batch.update([[1e-7 * (i + 1), 5e-8 * i, -2e-8 * i] for i in range(5)])
    return batch


@pytest.fixture(scope="session", autouse=True)
def _coarse_pictures():
    """Pictures that tests save have few pixels, as encoding them takes most of the time."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(STYLE, "savefig.dpi", 60)
        yield


@pytest.fixture
def full_resolution(monkeypatch):
    """Pictures are saved as for users; the resolution in dots per inch."""
    monkeypatch.setitem(STYLE, "savefig.dpi", RESOLUTION)
    return RESOLUTION


@pytest.fixture
def assumed_drawing_time(monkeypatch):
    """Estimates of the time of a run assume 1 s for pictures; no picture is drawn to measure it."""
    from dem_demo.output.pictures import Pictures

    monkeypatch.setattr(Pictures, "estimate_time", lambda self, frames: 1.0)


@pytest.fixture
def in_an_empty_folder(tmp_path, monkeypatch):
    """As a reader runs a command: in an empty folder, without a display."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "Agg")
    monkeypatch.setenv("COLUMNS", "80")
