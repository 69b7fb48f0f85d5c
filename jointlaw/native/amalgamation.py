"""jointlaw.h out of host.h: one file, whose names do not meet those of the host."""

import re

OWN = ("lanes.h", "bond.h", "law.h")  # whose names are short: a host may have the same
_DEFINED = re.compile(
    r"^#define (\w+)"
    r"|^(?:IN|static)\b[^;={(]*?(\w+)\("
    r"|^typedef [^;{]*?(\w+)(?: __attribute__.*)?;"
    r"|^\} (\w+);"
    r"|^typedef int (\w+), (\w+);",
    re.MULTILINE,
)
_WORDS = re.compile(r"/\*.*?\*/|\"[^\"\n]*\"|(?:\.|->)\s*\w+|\b[A-Za-z_]\w*", re.DOTALL)


def amalgamation(texts: dict[str, str]) -> str:
    """host.h with the files that it includes; texts: of all these files, by name."""
    names = {name for file in OWN for found in _DEFINED.findall(texts[file]) for name in found}
    names = {name for name in names if name and not name.startswith("JLAW_")}

    def unfold(text: str) -> str:
        return re.sub(
            r'^#include "(\w+\.h)"\n', lambda found: unfold(texts[found[1]]), text, flags=re.M
        )

    def longer(found: re.Match[str]) -> str:
        word = found[0]
        if word not in names:
            return word
        return f"JL_{word}_" if word.isupper() else f"jl_{word}_"

    head, mark, rest = unfold(texts["host.h"]).partition("#if defined(JOINTLAW_IMPLEMENTATION)")
    return head + mark + _WORDS.sub(longer, rest)
