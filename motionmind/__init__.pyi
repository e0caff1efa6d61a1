"""The public names, each listed once."""

from .body.human import human23 as human23
from .body.human import human44 as human44
from .body.motion import Insertion as Insertion
from .body.motion import Motion as Motion
from .body.motion import Posture as Posture
from .body.skeleton import Skeleton as Skeleton
from .chaos.flows import Flow as Flow
from .chaos.flows import flow_of as flow_of
from .corpus.store import list_corpora as list_corpora
from .credits.credit import Credit as Credit
from .discretize.library import write_library as write_library
from .discretize.naming import name_states as name_states
from .discretize.protocol import Discretization as Discretization
from .discretize.spec import make_discretization as make_discretization
from .errors import CorpusError as CorpusError
from .errors import FormatError as FormatError
from .errors import MotionMindError as MotionMindError
from .errors import MotionMindWarning as MotionMindWarning
from .errors import NoPathError as NoPathError
from .errors import SkeletonError as SkeletonError
from .errors import WrongTypeError as WrongTypeError
from .formats import lossy_fields as lossy_fields
from .formats import read_motion as read_motion
from .formats import read_posture as read_posture
from .formats import write_motion as write_motion
from .formats import write_posture as write_posture
from .formats.added import MotionReader as MotionReader
from .formats.added import MotionWriter as MotionWriter
from .gaps.gaps import Gaps as Gaps
from .gaps.gaps import find_gaps as find_gaps
from .learned.plausibility import Sighting as Sighting
from .metrics.measure import Figure as Figure
from .metrics.measure import measure as measure
from .notation.compose import compose as compose
from .notation.read import read_score as read_score
from .plots.angles import angle_chart as angle_chart
from .plots.attractor import write_attractor as write_attractor
from .plots.joint_graph import write_joint_graph as write_joint_graph
from .render.pictures import write_picture as write_picture
from .render.sheet import contact_sheet as contact_sheet
from .retarget.joint_mapping import read_joint_mapping as read_joint_mapping
from .retarget.retarget import own_skeleton as own_skeleton
from .retarget.retarget import to_human23 as to_human23
from .tween.certificate import Bridge as Bridge
from .tween.certificate import Source as Source
from .tween.certificate import Wait as Wait
from .tween.engine import Engine as Engine
from .tween.narrative import Explanation as Explanation
from .tween.narrative import explain as explain
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
    "CorpusError",
    "Credit",
    "Discretization",
    "Engine",
    "Explanation",
    "Figure",
    "Flow",
    "FormatError",
    "Gaps",
    "Insertion",
    "Motion",
    "MotionMindError",
    "MotionMindWarning",
    "MotionReader",
    "MotionWriter",
    "NoPathError",
    "Piece",
    "Posture",
    "Seam",
    "Sighting",
    "Skeleton",
    "SkeletonError",
    "Source",
    "Tween",
    "TweenReport",
    "TweenRequest",
    "Variation",
    "Wait",
    "WrongTypeError",
    "angle_chart",
    "compose",
    "contact_sheet",
    "explain",
    "find_gaps",
    "flow_of",
    "human23",
    "human44",
    "list_corpora",
    "lossy_fields",
    "make_discretization",
    "measure",
    "name_states",
    "own_skeleton",
    "read_joint_mapping",
    "read_motion",
    "read_posture",
    "read_report",
    "read_score",
    "read_variation",
    "to_human23",
    "vary",
    "write_attractor",
    "write_joint_graph",
    "write_library",
    "write_motion",
    "write_picture",
    "write_posture",
    "write_variation",
]
