"""What names of columns and channels, titles and remarks say of numbers and trials: relative, multiplied, left out."""

from __future__ import annotations

import re
from collections.abc import Set as AbstractSet
from typing import TYPE_CHECKING, Final

from isiw.errors import InvalidValueError
from isiw.existing.layout import COLUMNS, WORDS
from isiw.types import Reference

if TYPE_CHECKING:
    from isiw.existing.cells import Column

ALL: Final = "*"  # what `where` says of a column whose values are to be analysed together
MEANS: Final = re.compile(
    r"means?|average|avg|median|mittel(wert)?|moyen(ne)?s?|promedios?|\bm[eé]di[ae]\b|gemiddelden?|\bn ?= ?\d+|"
    r"średni|ortalama|平均|x̄"
)
TITLES_OF_MEANS: Final = re.compile(
    r"\b(means?|averages?|averaged|avg|mittelwerte?|gemittelte?n?|moyennes?|promedios?|m[eé]di[ae]s?|gemiddelden?|"
    r"średni\w*|ortalama\w*)\b|平均"
)  # what the names of files and sheets, and titles, say of means
_ORIGINS: Final = {
    "impact": r"valve|ventil|\bcommand|\bcmd\b|solenoid|vanne|v[aá]lvula|valvola|\bklep|actuator",
    "valve": r"\b(impact|hit|contact|aufprall|acceler)",
}  # from another event
_BASES: Final = r"(contr[oô]\w*|base|baseline|mean|unconditioned|kontrolle|tests?|ts|tms alone|single|m ?max)"
_SCALED: Final = (
    r"%|yüzde|比|\bper ?c|\bpct\b|pro[zc]ent|p(our|or)cent|\bratio\b|quotient|\b(ge|z)?norm(ed|ali[sz]\w*|iert)?\b|"
    r"\brel(ati\w*)?\b|\bz\b|\bz ?scores?|\blog\d*\b|\bln\b|\bsqrt\b|\ba ?\. ?u\b|\barb|\bfold\b|\bchange\b|"
    r"\bdb|ggü|gegenüber|\brank|[\^√]|\bresid|\bfraction\b|box.?cox|fitted|predict|smooth|winsor|detrend|adjusted|\bcent(ere|re)d|standardi[sz]|"
    rf"\bfa[ck]tor\b|facilitation|inhibition|m ?max\b|([/÷]|\b(x|times|div|by|vs|re)\b) ?{_BASES}\b"
)
RELATIVE: Final = (
    rf"{_SCALED}|\bdelta\b|\bd mep\b|[δΔ]|\bdiff|\bminus\b|mep +- |[/÷] *mep\b|\bn mep\b|\bmep +n\b(?! ?=)|"
    r"\bmep\b.*\bmep\b|\bindex\b(?! ?finger)"
)
WHOLE: Final = r"peak\W*(to|2)?\W*peak|\bp\W?(2|to|t)?\W?p\b|max\w*\W+(to\W+)?min"  # from peak to peak
_HALVES: Final = (
    r"\b(bas[ei]|zero|0|onset|null|neg|pos)\w* ?(-|to)* ?(peak|spitze|crête|pic)|\bhalf\b|\b0-p\b|one.sided"
)
_MEASURES: Final = (
    rf"{_HALVES}|\b[aá]rea\b|\baire\b|fläche|\bauc\b|\brms\d*\b|tkeo|teager|\babs\b|\benv\b|integra|\biemg\b|rectif|\brect\b(?!\W*(fem|abd))|gleichger|"
    r"\b(envelope|arv|mav|turns|power|energy|snr|counts|adc|adu|lsb)\b|"
    r"lat[eê]n[ctz]|superfici|oppervlak|\bdur(ation|ée|ata|ación)|dauer\b|silent|\bcsp\b|\bh.?reflex|\bforce\b|kraft|"
    r"[\[(] ?(counts?|adc|adu|bits?|lsb|digits?|units?|[cm]m|kv|pu|sd|au)\b|"
    r"\b[mµμu]?v([²/]| ?[*·×] ?m?s\b|m?s\b)"
)
_ENDS: Final = rf"^(?!.*({WHOLE})).*\b(trough|max|maximum|min|minimum)\b"
_GAIN: Final = r"\bgain(?![^\W\d])|\bamplifi?(ed|cat|cac|caz)|verstärk|\bganancia|\bganho|\bguadagno|\bversterking"
_A_GAIN: Final = re.compile(
    rf"({_GAIN})\w*\W*([^\W\d_]+\W+){{0,2}}x?(?!1(\.0*)?\b)\d+|\b\d+ ?(x|fold|fach|times)\w* ({_GAIN})"
)  # with a number that is not 1
_AT_ELECTRODES: Final = re.compile("at the electrode|an den elektroden|corrected|referred|rückgerechnet|korrigiert")
_POWER: Final = r"10 ?[\^⁺⁻⁰¹²³⁴-⁹]"
_FACTOR: Final = (
    rf"{_POWER}|[×*·/÷] ?\d|(?<![a-z])x ?\d|\b\d+ ?([×*·]|x\b)|(\b|\d)e ?[-+]\d|"
    r"(?<![\w.,<>≤≥=-])(10+|0[.,]\d+) ?([mµμu]?s(ec)?|[mµμun]?v) ?([])]|$)"
)  # such as x10 ms, 1/10 mV, 10^-1 or 0.1 ms
_NUMBERS: Final = (
    r"\b(codes?|index|idx|levels?|bins?|class|category|nr|no|number|stufe|rank|log\d*|ln|z)\b|"
    r"[\[(] ?([cd]s|ticks?|steps?|samples?(?= ?@)|pts?|points?|min|hz|deg|a\.? ?u|frames?|%)\b"
)
_TAP: Final = r"(tap|cs|impact|hammer|hit|schlag|conditioning|pns|electrical|cond)"
_OTHERWISE: Final = (
    ("mep", rf"{_GAIN}|{_FACTOR}", "are multiplied", "amplitudes at the electrodes"),
    ("mep", RELATIVE, "are relative to others", "peak-to-peak amplitudes in mV, µV or V"),
    ("mep", f"{_MEASURES}|{_ENDS}", "are of another measure", "amplitudes from peak to peak"),
    ("isi", _FACTOR, "are multiplied", "the intervals themselves, in ms or s"),
    ("isi", _NUMBERS, "are numbers of something", "the intervals themselves, in ms or s"),
)  # fmt: skip # what a column's name says of numbers that are no amplitudes or ISIs, and what is expected
_OF_CHANNELS: Final = re.compile(  # which may be of a difference, and have numbers of their own
    rf"{_GAIN}|{_POWER}|(?<!^)[x×*] ?10|\b1/10|(\b10+|0[.,]\d+) ?[mµμun]?v\b|{_SCALED}|{_MEASURES}|"
    r"\b(means?|averaged?|averages?|avg|gemittelt|mittelwerte?|moyennes?)\b"
)
_REVERSED: Final = (
    rf"\b(tms|ts|pulse|test)\b ?(-|–|→|>|to|bis|vers)+ ?{_TAP}\b|"
    rf"\b{_TAP}\b (after|nach|post|après|re|rel\w* to) (the )?(tms|ts|pulse)\b"
)
_ORDERS: Final = {
    r"\b(trigger|trig|ttl)\b": "counts from a trigger: of the tap, or of the valve?",
    _REVERSED: "says that the pulse came before the tap",
}  # what the name of ISIs says of what they count from
_OF_AMPLITUDES: Final = re.compile(r"\b(meps?|amplitu\w*|values?|werte|responses?|emg)\b|ampiezz")
_OF_INTENSITY: Final = re.compile(r"rmt|amt\b|\bmso\b|\bmt\b|threshold|intensit|stimulator|output|mvc|confiden|\bci\b")
_AFTER: Final = r"\b(from|after|since|relative to|ab|nach|seit|depuis|desde|dalla?)"
_ANY_TITLES: Final = {
    rf"(%|p(er|our|or|ro) ?[zc](ent\w*|iento)) (of|vom|von|der|de|du|del|van) ?(the )?{_BASES}|"
    r"\b(ge|z)?norm(ali[sz]\w*|iert)|\bmeps? ?/|^%$": "to be relative",
    r"\b(averages?|averaged|means?|mittel\w*|gemittelt|moyennes?) (of|over|across|von|aus|über|de) "
    r"(\d+|two|three|four|five|six|eight|ten|several) (\w+ )?(meps|sweeps|trials|pulses|stimuli|responses)|"
    r"\b(meps|sweeps|trials|frames|pulses) (averaged|gemittelt)\W*(?!1\b)\d": "to be means of several trials",
    r"\bunits of \d": "to be multiplied",
    r"\b(rows?|trials?|sweeps?|zeilen?|versuche?|essais) \d+ ?(-|–|to|bis|à) ?\d+:? [^\W\d]": "to be of several kinds",
}  # what a title says in whatever clause
_TITLES: Final = {
    r"%|per ?cent|prozent|pour ?cent|por ?ciento|\bz-? ?scor|\b(log|ln)s?\d*\b(?! ?(file|book|sheet))|\blogar|"
    r"transform|square root|\bratios?\b|divided by|geteilt durch|"
    r"\brel(ative)? to\b(?! (the )?(\w+ )?(impact|tap|hit|valve|pulse|onset|stimul))|\bmultiples? of\b|\bfold\b|"
    rf"bezogen auf|par rapport|\bm ?max\b|[/÷] ?{_BASES}\b": "to be relative",
    rf"\bmep areas?\b|rectified|{_HALVES}": "to be of another measure",
    r"[x×*] ?10+\b|\btimes 10+\b|multiplied|\bin (10+|0[.,]\d+) ?[mµμun]?v\b": "to be multiplied",
}  # what a title says of amplitudes in the same clause
_LEFT_OUT: Final = (
    r"(reject\w*|exclu\w*|bad|invalid|discard\w*|art[ei]fa[ck]t\w*|outliers?|omit(ted)?|removed|skip(ped)?|drop(ped)?|verworfen\w*|"
    r"ausgeschlossen\w*|ungültig\w*|rejet\w*|scartat\w*|esclus\w*|rechazad\w*|descartad\w*|uitgesloten)"
)
_NUMBER: Final = r"[1-9]\d*\b(?!\.\d| ?(%|of\b|von\b|trials?|sweeps?|[mµμu]?v\b|m?s\b|sd\b|hz))"
_LISTED: Final = re.compile(
    rf"\b{_LEFT_OUT}\b\W*((in|of|trials?|sweeps?|frames?|stimul\w+|nr|no|versuche?|essais?)\b\W*)*{_NUMBER}|"
    rf"\b(trials?|sweeps?|versuche?|nr|essais?)\W+{_NUMBER}(\W+(and |und |et )?\d+)*\W+(\w+\W+){{0,2}}{_LEFT_OUT}\b"
)  # numbers of trials that do not count
_OF_GAIN: Final = "Divide the amplitudes by it; if they are those at the electrodes already"
_HARMLESS: Final = WORDS["harmless"] | WORDS["counted"]
_DENIED: Final = WORDS["left out"] | WORDS["flags"] | WORDS["deniable"] | WORDS["no"]
_CLAUSES: Final = re.compile(r"[\n;]|[.,](?=\s)")
_WORDS: Final = 4  # in a longer remark bad may be of something


def words_of(name: str) -> str:
    """A name in lower case, its words apart; units such as mV are one."""
    return re.sub("mep(?!s)", " mep ", re.sub(r"(?<=[a-z]{2})(?=[A-Z])", " ", name.replace("_", " ")).casefold())


def doubtful_words(text: str) -> list[str]:
    """What a text has of amplitudes that are relative to others or multiplied, or of means."""
    return [found[0] for pattern in (RELATIVE, _FACTOR, MEANS) if (found := re.search(pattern, words_of(text)))]


def not_as_recorded(text: str) -> str | None:
    """What a channel's name, or what else a file says of it, has of EMG that is not as it was recorded."""
    return found[0].strip() if (found := _OF_CHANNELS.search(words_of(text))) else None


def require_of_kind(key: str, what: str, name: str, source: str) -> None:
    """Raise if a column's name says that its numbers are something else, whatever unit is stated."""
    for of, pattern, are, expected in _OTHERWISE:
        if of == key and (found := re.search(pattern, words_of(name))):
            what = f"the {what} of {source} in the column {name!r} {are}"
            remedy = f"Name the column that holds these: --column {key}=NAME; if it is this one, correct its name."
            raise InvalidValueError(what, got=found[0].strip(), expected=expected, remedy=remedy)


def require_reference(kind: str, key: str, name: str, reference: Reference | None, source: str) -> None:
    """Raise if the name of ISIs, or of what marks their beginning, says another event than the one that is stated."""
    if reference is not None and (found := re.search(_ORIGINS[reference], words_of(name))):
        remedy = f"Correct --reference, or name the {kind} of the other: --{kind} {key}=NAME."
        what = f"the {kind} {name!r} of {source} counts from another event than is stated"
        raise InvalidValueError(what, got=reference, expected=f"what {found[0]!r} says", remedy=remedy)


def require_order(isi: Column) -> None:
    """Raise if the name of ISIs says that they count from a trigger, of whatever, or from the pulse to the tap."""
    for pattern, says in _ORDERS.items():
        if found := re.search(pattern, words_of(isi.name)):
            isi.doubt(says, found[0], "If they count from the event that is stated, and it came first")


def require_title(title: str, mep: Column, reference: Reference | None, notes: str = "") -> None:
    """Raise if a title, or what stands below the trials, says what amplitudes or ISIs are, or which do not count.

    Of notes elsewhere, as on other sheets, it must say nothing of trials that do not count, and no gain.
    """
    every = words_of(f"{title}\n{notes}")
    if found := _LISTED.search(" ".join(every.split())):
        remedy = "Mark them in a column called exclude, and remove that line; if they are left out already"
        mep.doubt("stands beside a line that says which trials do not count", found[0], remedy)
    if (found := _A_GAIN.search(every)) and not _AT_ELECTRODES.search(every):
        mep.doubt("stands below a title that says a gain", found[0], _OF_GAIN)
    origin = "(?!)" if reference is None else rf"{_AFTER} (the )?(\w+ ){{0,2}}?({_ORIGINS[reference]})"
    for clause in (" ".join(each.split()) for each in _CLAUSES.split(words_of(title))):
        if found := re.search(origin, clause):
            why, remedy = "counts ISIs from another event", "Correct the title, or --reference; if both are right"
            mep.doubt(f"stands below a title that {why}", reference, remedy, found[0])
        is_of_meps = _OF_AMPLITUDES.search(clause) and not _OF_INTENSITY.search(clause)
        for pattern, seems in (_ANY_TITLES | (_TITLES if is_of_meps else {})).items():
            if found := re.search(pattern, clause):
                remedy = "Correct the title, or the name of the file or sheet; if they are as they were measured"
                mep.doubt(f"seems {seems} by what the title says", found[0], remedy)


def require_no_flags(column: Column) -> None:
    """Raise if a column of which nothing is read has flags, by its name or by words of what counts, or a gain."""
    gains = [text for text in column.texts if text not in {"", "0", "1"}]
    if gains and re.search(_GAIN, words_of(column.name)):
        column.doubt("has a gain, and nothing is read of it", gains[0], _OF_GAIN)
    texts = [*map(str.casefold, column.texts)]
    key = key_of_flags(column.name) or ("exclude" if WORDS["counted"] & {*texts} else None)
    kinds = {"exclude": WORDS["yes"], "status": WORDS["no"] | {""}}.get(key or "", WORDS["no"]) | WORDS["left out"]
    odd = [row for row, text in enumerate(texts) if text in kinds]
    are_flags = {*texts} <= {"", *WORDS["yes"], *WORDS["no"], *WORDS["counted"], *WORDS["left out"]}
    if key and are_flags and 0 < len(odd) < len(texts):
        remedy = f'Say --column "{key}={column.name}"; if such trials count'
        column.doubt("says that the trial does not count, and nothing is read of it", None, remedy, row=odd[0])


def says_only(text: str, known: AbstractSet[str]) -> bool:
    """True if a text, besides what stands in brackets, has words of a kind alone, such as SD (mV) or Mean block 2."""
    bare = re.sub(r"[\[(].*?[\])]|\bn ?= ?\d+", " ", words_of(text))
    words = [word for word in re.findall(r"\w+", bare) if word not in WORDS["beside spreads"]]
    words = [word for n, word in enumerate(words) if n == 0 or not re.fullmatch(r"[a-z]?\d+", word)]
    return bool(words) and ({*words} <= known or "".join(words).rstrip("0123456789") in known)


def key_of_flags(name: str) -> str | None:
    """What a column would hold whose name has a word of trials that do not count, or of those that do."""
    words = {re.sub("(trial|sweep|frame|epoch)s?$", "", word) for word in re.findall(r"[^\W\d_]+", words_of(name))}
    kinds = {"exclude": WORDS["left out"] | WORDS["flags"], "status": WORDS["counted"]}
    return next((key for key, known in kinds.items() if words & (known | {*COLUMNS[key]})), None)


def is_verdict(text: str) -> bool:
    """True if a short remark has a word of trials that do not count."""
    said = text.casefold().partition(":")[0]
    words = {*(re.findall(r"\w+", said) if said.count(" ") < _WORDS else ())}
    return not words.isdisjoint(WORDS["left out"] | WORDS["flags"]) and words.isdisjoint(WORDS["no"])


def is_remark(text: str) -> bool:
    """True if a text is neither a number nor known to be harmless, as a pause is, or an artefact that did not come."""
    words = {*re.findall(r"[^\W\d_]+", text.casefold())}
    known = _HARMLESS if words.isdisjoint(WORDS["no"]) else _DENIED
    return not words <= known if words else bool(text) and not re.search(r"\d", text)
