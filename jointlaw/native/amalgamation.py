"""placeholder"""


def amalgamation(texts):
    return ""
