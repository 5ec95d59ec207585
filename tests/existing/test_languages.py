"""Tables as labs write them in German, French, Spanish, Italian and Dutch."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from isiw.errors import IsiwError
from isiw.existing.delivered import Delivered
from isiw.existing.layout import Layout
from isiw.existing.reading import read_people

ISIS_MS = (10, 25, 40, 60, 80, 100, 120, 150)
MEPS_MV = (0.11, 0.22, 0.45, 0.93, 0.91, 0.44, 0.17, 0.12)
IMPACT = Layout(reference="impact")


def table(path: Path, names: str, *rows: tuple[Any, ...], title: str = "") -> Path:
    """A table with semicolons and decimal commas, its names and cells as they are written."""
    lines = [";".join(f"{cell}".replace(".", ",") for cell in row) for row in rows]
    (path / "P01.csv").write_text("\n".join([*filter(None, [title]), names, *lines]), encoding="utf-8")
    return path / "P01.csv"


def pairs(*besides: object, times: int = 1) -> list[tuple[Any, ...]]:
    return [(isi, mep, *besides) for _ in range(times) for isi, mep in zip(ISIS_MS, MEPS_MV, strict=True)]


def read(path: Path, layout: Layout = IMPACT) -> Delivered:
    return read_people(path, layout)[0]


@pytest.mark.parametrize(
    ("names", "no", "yes"),
    [
        ("Intervalle (ms);Amplitude crête à crête (mV);Exclu", "non", "oui"),
        ("Intervalo [milisegundos];Amplitud (milivoltios);Excluido", "no", "sí"),
        ("Intervallo (ms);Ampiezza MEP (mV);Escluso", "no", "sì"),
        ("Intervalle (ms);Amplitude PEM (mV);Exclu", "non", "oui"),
        ("Intervalle (ms);Amplitude pic à pic (mV);Exclu", "non", "oui"),
        ("ISI (ms);Amplitude (mV);Uitgesloten", "nee", "ja"),
        ("Reizabstand (ms);Amplitude (mV);Ausgeschlossen", "nein", "ja"),
    ],
)
def test_columns_are_found_and_excluded_trials_do_not_count(names: str, no: str, yes: str, tmp_path: Path) -> None:
    person = read(table(tmp_path, names, *pairs(no), (200, 0.5, yes)))
    assert [(trial.isi_ms, trial.mep_mv) for trial in person.trials.told] == pairs()


def test_the_sheet_with_trials_is_found_below_its_titles(tmp_path: Path) -> None:
    rows = [["Séance du 3 février", None, None], ["Sujet", "Intervalle (ms)", "Amplitude (mV)"]]
    rows += [[who, *pair] for who in ("A1", "A2") for pair in pairs()]
    with pd.ExcelWriter(tmp_path / "P01.xlsx") as book:
        pd.DataFrame([["Labo"], ["Lyon"]]).to_excel(book, sheet_name="Résumé", index=False, header=False)
        pd.DataFrame(rows).to_excel(book, sheet_name="Données", index=False, header=False)
    assert [person.subject for person in read_people(tmp_path / "P01.xlsx", IMPACT)] == ["A1", "A2"]


BESIDE = ("Standardabweichung", "Std.-Abw. (mV)", "écart-type", "desviación estándar", "deviazione standard",
          "MEP SD (mV)", "standaarddeviatie", "Nombre", "Aantal")  # fmt: skip
TITLES = ("Moyennes", "Promedios", "Medie", "Gemiddelden van 12 trials", "Mittelwerte")
SUMS = ("Moyenne", "Promedio", "Media", "Gemiddelde", "Totale", "Teilergebnis", "Sous-total", "Mittelwert ± SD (n=8)")
REMARKS = ("artéfact", "à rejeter", "artefacto", "da scartare", "ongeldig", "ungültig")
ASKED: list[tuple[str, list[tuple[Any, ...]], str, str]] = [
    *(("MEP (mV);" + beside, pairs(12), "", "means of several trials") for beside in BESIDE),
    *(("MEP (mV)", pairs(), title, "means of several trials") for title in TITLES),
    *(("MEP (mV);subject", [*pairs("A1"), (73, 0.4, word)], "", "is none of a trial") for word in SUMS),
    *(("MEP (mV);nota", [*pairs(""), (200, 0.5, word)], "", "does not count") for word in REMARKS),
]


@pytest.mark.parametrize(("names", "rows", "title", "says"), ASKED)
def test_what_is_no_table_of_single_trials_is_known_by_its_words(
    names: str, rows: list[tuple[Any, ...]], title: str, says: str, tmp_path: Path
) -> None:
    with pytest.raises(IsiwError, match=says):
        read(table(tmp_path, f"ISI (ms);{names}", *rows, title=title))


def test_a_column_of_units_that_says_per_cent_is_of_the_amplitudes(tmp_path: Path) -> None:
    with pytest.raises(IsiwError, match="relative"):
        read(table(tmp_path, "ISI (ms);MEP;unit", *pairs("%")), IMPACT.saying(units=("uV",)))
