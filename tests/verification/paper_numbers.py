"""The numbers of a claim of the paper, for the tests that know some of them from elsewhere."""

from jointlaw.paper.contents import CLAIMS


def numbers(key, verdict="holds"):
    """What is measured for a claim, whose verdict must be this one."""
    claim = CLAIMS[key]
    found = claim.measure()
    assert claim.verdict(found) == verdict
    return found
