"""What software behind a transport answers, honestly or in one of many wrong ways. Knows nothing of isiw."""

from __future__ import annotations

from typing import Any

Values = dict[str, Any]


def answer(request: Values, lie: str = "") -> Values:
    """The answer to a request; a lie spoils the answer to a delivery, or to the verb that it names."""
    done = {"arm": "armed", "deliver": "delivered", "disarm": "disarmed"}[request["verb"]]
    values: Values = {"token": request["token"], "number": request["number"], "said": done}
    if request["verb"] != "deliver":
        return values | (
            {"said": "failed", "reason": "the relay is stuck"} if lie == f"cannot {request['verb']}" else {}
        )
    values |= {"trial": request["trial"]}
    values |= {"set_isi_ms": request["isi_ms"]} if "isi_ms" in request else {}
    return spoilt(values, lie)


def spoilt(values: Values, lie: str) -> Values:
    """The answer to a delivery as a lie leaves it."""
    changes: dict[str, Values] = {
        "refuses": {"said": "refused", "reason": "no air\x1b[2J"},
        "fails": {"said": "failed", "reason": "trigger lost"},
        "says another thing": {"said": "armed"},
        "says nothing": {"said": ""},
        "another trial": {"trial": int(values["trial"]) + 1},
        "another ISI": {"set_isi_ms": 505.0},
        "an unknown key": {"t_hits_ms": 3.0},
        "an earlier run": {"token": "0badf00d"},
        "a later number": {"number": int(values["number"]) + 1},
        "no number": {"set_isi_ms": "fifty"},
        "NaN": {"set_isi_ms": "nan"},
    }
    values = values | changes.get(lie, {})
    if lie == "no ISI":
        del values["set_isi_ms"]
    return values
