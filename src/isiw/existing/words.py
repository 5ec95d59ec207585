"""Words that files of labs have, in the languages of those who write them: of units, columns, events, and in cells."""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import lru_cache
from typing import Final

_UNITS: Final = {
    "ms": "ms msec msecs millisec millisecond milliseconds millisekunden millisecondes milisegundos millisecondi "
          "milliseconden",
    "s": "s sec secs second seconds sekunden secondes segundos secondi seconden",
    "us": "us µs μs microsecond microseconds",
    "V": "v volt volts",
    "mV": "mv mvolt mvolts millivolt millivolts milivoltios",
    "uV": "uv µv μv microv uvolt uvolts µvolt µvolts microvolt microvolts mikrovolt microvoltios",
    "nV": "nv nvolt nanovolt nanovolts",
    "samples": "sample samples frames",
    "mV·ms": "mvms mv*ms mv·ms uvms uv*ms uv·ms µvms µv*ms µv·ms μv·ms",  # of areas, and of no amplitude
    "%": "%",
}  # fmt: skip
UNIT_WORDS: Final[Mapping[str, str]] = {word: unit for unit, words in _UNITS.items() for word in words.split()}
"""Units as files write them, in lower case."""
_COLUMNS: Final = {
    "isi": "isi realisedisi isirealised actualisi interstimulusinterval interpulseinterval ipi "
           "interstimulusintervall interval delay soa intervall reizabstand abstand verzögerung "
           "intervalle intervalo intervallo",
    "mep": "mep mepamplitude mepamp mepp2p meppp mepptp meppeaktopeak mepsize ptpmep mepspitzespitze amplitude "
           "peaktopeak peaktopeakamplitude emgpeaktopeak p2pamplitude ptpamplitude p2p ptp amp spitzespitze "
           "amplitud ampiezza amplitudecrêteàcrête amplitudpicoapico ampiezzapiccopicco piekpiek",
    "asked": "commandedisi askedisi nominalisi targetisi plannedisi isicommanded isinominal sollisi sollintervall",
    "isi_sd": "isisd",
    "background": "backgroundrms background prestimrms rmsbackground baselinerms hintergrund",
    "status": "status accepted accept valid include included keep good gültig verwertbar valide válido valido geldig",
    "exclude": "excluded exclude rejected reject bad artefact artifact ausschluss ausgeschlossen verworfen artefakt "
               "exclu rejeté artéfact excluido rechazado artefacto escluso scartato artefatto uitgesloten verworpen",
    "reason": "reason grund",
    "tap_alone": "tapalone",
    "intensity": "intensitypctrmt pctrmt intensityrmt percentrmt intensitypercentrmt",
    "subject": "subject subjectid participant participantid subj person patient sub proband probandin "
               "versuchsperson vp teilnehmer teilnehmerin sujet sujeto participante soggetto partecipante proefpersoon "
               "deelnemer id",
    "day": "day visit session sessionid ses sitzung termin messtag séance sesión sessione sessie",
    "condition": "condition trialtype stimulus type bedingung reizart condición condizione conditie",
    "block": "block run bloc bloque blocco blok",
    "order": "trial trialnumber trialno trialnr index onset time durchgang uhrzeit essai ensayo prova",
    "date": "date recordingdate datum fecha",
}  # fmt: skip
COLUMNS: Final[Mapping[str, tuple[str, ...]]] = {key: tuple(names.split()) for key, names in _COLUMNS.items()}
"""By what they are called in letters alone, the columns that are found without being named; the first name wins."""
_SETS: Final = {
    "missing": ",nan,(null),na,n/a,none,null,<na>,nat,-,--,–,—,.,?,k.a.,n.d.",
    "yes": "1,1.0,true,yes,y,x,accepted,accept,ok,good,valid,keep,ja,j,gut,gültig,oui,sí,si,sì",
    "no": "0,0.0,false,no,n,mistrial,rejected,reject,bad,invalid,excluded,nein,schlecht,ungültig,non,nee",
    "alone": "tms alone,tms only,tms,single,single pulse,single tms,sp,alone,ts,baseline,control,unconditioned,"
             "unpaired,ts alone,ts only,test,test alone,test only,test pulse,test stimulus,no tap,nur tms,tms allein,"
             "einzelpuls,einzelreiz,kontrolle,ohne tap,ohne schlag,tms seule,smt seule,contrôle,tms sola,tms solo,"
             "alleen tms",
    "tap alone": "tap alone,tap only,hit only,hammer only,no tms,no pulse,cs alone,cs only,conditioning alone,"
                 "conditioning only,nur tap,nur schlag,tap allein,ohne tms",
    "left out": "mistrial,rejected,reject,bad,invalid,excluded,exclude,discard,discarded,artefact,artifact,outlier,"
                "schlecht,ungültig,verworfen,ausgeschlossen,artefakt,ausreißer,exclu,rejeté,à rejeter,artéfact,mauvais,"
                "excluido,rechazado,descartado,artefacto,inválido,escluso,scartato,da scartare,artefatto,uitgesloten,"
                "verworpen,afgekeurd,ongeldig,slecht",
    "spreads": "sd,std,stdev,stddev,se,sem,stderr,cv,sds,standarddeviation,standarderror,ci,iqr,var,variance,"
               "stdabw,stabw,standardabweichung,standardfehler,streuung,varianz,écarttype,erreurtype,desviaciónestándar,"
               "desvest,errorestándar,deviazionestandard,standaarddeviatie,standaardfout",
    "beside spreads": "mep,amplitude,of,lower,upper,low,high,mv,uv,v,95",
    "sums": "sum,total,grand mean,summe,gesamt,somme,suma,somma,som,totale,totaal",
    "numbers": "n,count,ntrials,trials,ntrial,nobs,nsweeps,sweeps,anzahl,nmep,nmeps,naveraged,averaged,numberoftrials,"
               "anzahlreize,nombre,nombredessais,número,númerodeensayos,numero,aantal",
    "vague": "interval,intervalle,intervalo,intervallo,delay,soa,amplitude,amp,peaktopeak,peaktopeakamplitude,"
             "emgpeaktopeak,p2pamplitude,ptpamplitude,p2p,ptp",
    "rates": "fs,srate,samplerate,samplingrate,samplingfrequency,sfreq,rate,ratehz",
    "periods": "interval,samplinginterval,sampleinterval,dt",
}  # fmt: skip
WORDS: Final[Mapping[str, frozenset[str]]] = {kind: frozenset(words.split(",")) for kind, words in _SETS.items()}
"""In lower case, what cells say (missing, yes, no, alone, tap alone, left out), and names of columns, in letters alone:
of spreads and sums, of numbers of trials, vague ones that give way to others, and of rates and periods of sampling."""
MARKS: Final[Mapping[str, tuple[str, str]]] = {
    "pulse": ("the pulse of TMS", "tms pulse tmspulse magneticpulse"),
    "tap": ("the tap (its impact) or the electrical pulse", "tap impact hit electricalpulse conditioning pns"),
    "valve": ("the valve command", "valve valvecommand"),
    "alone": ("TMS alone", "tmsalone tmsonly singlepulse pulsealone unconditioned"),
}
"""What is marked, in words, and what events of it are called that need not be named, without blanks."""


@lru_cache(2**16)  # in a long table most cells are like others
def plain(text: str) -> str:
    """A text in lower case, with blanks for hyphens and underscores."""
    return " ".join(re.split(r"[\s_-]+", text.strip().casefold()))


def letters(name: str) -> str:
    """A column's name in letters alone, without its unit."""
    words = re.findall(r"[^\W_]+", re.sub(r"[\[(][^][()]*[\])]", " ", name.casefold()))
    while len(words) > 1 and (words[-1] in UNIT_WORDS or words[-1] == "in"):
        words.pop()
    return "".join(words)


def unit_named(word: object) -> str | None:
    """The unit that a word is, if it is known."""
    return UNIT_WORDS.get(str(word).strip().casefold())
