"""The public names of the package itself, each listed once."""

from .body.human import human23 as human23
from .body.human import human44 as human44
from .body.motion import Insertion as Insertion
from .body.motion import Motion as Motion
from .body.motion import Posture as Posture
from .body.motion import Velocity as Velocity
from .body.skeleton import Skeleton as Skeleton
from .corpus.corpus import Corpus as Corpus
from .corpus.store import list_corpora as list_corpora
from .errors import CorpusError as CorpusError
from .errors import FormatError as FormatError
from .errors import MotionMindError as MotionMindError
from .errors import MotionMindWarning as MotionMindWarning
from .errors import NoPathError as NoPathError
from .errors import SkeletonError as SkeletonError
from .errors import WrongTypeError as WrongTypeError
from .formats import read_motion as read_motion
from .formats import read_posture as read_posture
from .formats import write_motion as write_motion
from .formats import write_posture as write_posture
from .names.postures import FoundPosture as FoundPosture
from .names.postures import find_posture as find_posture
from .notation.compose import compose as compose
from .notation.read import read_score as read_score
from .notation.score import Score as Score
from .render.pictures import draw_picture as draw_picture
from .render.sheet import draw_sheet as draw_sheet
from .retarget.retarget import own_skeleton as own_skeleton
from .tween.certificate import Bridge as Bridge
from .tween.certificate import Source as Source
from .tween.certificate import Wait as Wait
from .tween.engine import Engine as Engine
from .tween.narrative import Explanation as Explanation
from .tween.narrative import explain as explain
from .tween.options import SearchOptions as SearchOptions
from .tween.report import TweenReport as TweenReport
from .tween.report import read_report as read_report
from .tween.request import TweenRequest as TweenRequest
from .tween.result import Tween as Tween
from .variation.piece import Piece as Piece
from .variation.review import Seam as Seam
from .variation.variation import Variation as Variation
from .variation.variation import vary as vary
from .variation.variation_json import read_variation as read_variation
from .variation.variation_json import write_variation as write_variation

__version__: str

__all__ = [
    "Bridge",
    "Corpus",
    "CorpusError",
    "Engine",
    "Explanation",
    "FormatError",
    "FoundPosture",
    "Insertion",
    "Motion",
    "MotionMindError",
    "MotionMindWarning",
    "NoPathError",
    "Piece",
    "Posture",
    "Score",
    "Seam",
    "SearchOptions",
    "Skeleton",
    "SkeletonError",
    "Source",
    "Tween",
    "TweenReport",
    "TweenRequest",
    "Variation",
    "Velocity",
    "Wait",
    "WrongTypeError",
    "compose",
    "draw_picture",
    "draw_sheet",
    "explain",
    "find_posture",
    "human23",
    "human44",
    "list_corpora",
    "own_skeleton",
    "read_motion",
    "read_posture",
    "read_report",
    "read_score",
    "read_variation",
    "vary",
    "write_motion",
    "write_posture",
    "write_variation",
]
