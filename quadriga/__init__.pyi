from quadriga.api.configuration import load_config as load_config
from quadriga.api.paired import PairedComparison as PairedComparison
from quadriga.api.paired import compare_paired as compare_paired
from quadriga.api.paired import read_trials as read_trials
from quadriga.api.replayed import ReplayResult as ReplayResult
from quadriga.api.run import Run as Run
from quadriga.api.run import open as open
from quadriga.api.topic_arrays import TopicArrays as TopicArrays
from quadriga.api.topic_arrays import TopicField as TopicField
from quadriga.api.tracking_arrays import TrackingArrays as TrackingArrays
from quadriga.api.walking import walk as walk
from quadriga.shared.config.sections import Config as Config
from quadriga.shared.errors import BusError as BusError
from quadriga.shared.errors import ConfigError as ConfigError
from quadriga.shared.errors import PredictorError as PredictorError
from quadriga.shared.errors import ProcessError as ProcessError
from quadriga.shared.errors import QuadrigaError as QuadrigaError
from quadriga.shared.errors import RecordingError as RecordingError

__all__ = [
    "BusError",
    "Config",
    "ConfigError",
    "PairedComparison",
    "PredictorError",
    "ProcessError",
    "QuadrigaError",
    "RecordingError",
    "ReplayResult",
    "Run",
    "TopicArrays",
    "TopicField",
    "TrackingArrays",
    "compare_paired",
    "load_config",
    "open",
    "read_trials",
    "walk",
]
