"""What a user of the command line can get wrong, besides what `ident` and `sim` refuse.

One class per cause; `ScenarioError` and `StudyError` are what they have in common and are never raised. Every message
is one line for the user.
"""


class ScenarioError(ValueError):
    """A scenario, or what it is used for, that cannot be."""


class UnknownKey(ScenarioError):
    """A key that scenario files do not have."""


class UnknownName(ScenarioError):
    """The name of a scenario, motion, payload or method that does not exist."""


class UnreadableFile(ScenarioError):
    """A scenario or motion file that is missing, too large, or no TOML that can be meant."""


class WrongExtends(ScenarioError):
    """Scenarios that extend themselves, too many others, or nothing."""


class WrongMotion(ScenarioError):
    """A motion file that holds no motion that starts and ends at rest."""


class UnknownPlace(ScenarioError):
    """A place that a scenario does not have, or that holds no value."""


class WrongValue(ScenarioError):
    """A value of the wrong type or outside its range."""


class WrongLength(ScenarioError):
    """An array or motion that has not one entry a joint."""


class WrongPayload(ScenarioError):
    """A believed payload that is impossible."""


class WrongDraw(ScenarioError):
    """A random change that cannot be made."""


class TooFewSeeds(ScenarioError):
    """Seeds that no assertion can be made with."""


class StudyError(ScenarioError):
    """A study that cannot be carried out."""


class StudyTooLarge(StudyError):
    """More trials than seeds, or than a design can have."""


class NoDesign(StudyError):
    """Numbers that no design of a sensitivity study has."""


class NoSources(StudyError):
    """A sensitivity study of a scenario without error sources, or without a gain they could cost."""


class NotLinear(StudyError):
    """A method whose errors have no first order to be predicted from."""


class NotAPair(StudyError):
    """A protocol without a bare and a loaded motion, which a design needs."""


class NotPredicted(StudyError):
    """A source whose cost first order does not tell."""


class NoMoments(StudyError):
    """A draw whose numbers have no mean or no deviation."""


class NoGains(StudyError):
    """A sensitivity study in which no trial gave some joint a gain."""


class ForeignFolder(StudyError):
    """A folder that is no study, or a file in it that is no part of one."""


class OtherStudy(StudyError):
    """The folder of a study that another scenario, seed, version or file has begun."""


class FolderInUse(StudyError):
    """A folder that another process is at work in."""


class FolderNotWritable(StudyError):
    """A folder that cannot be made or written."""


class DamagedFolder(StudyError):
    """A record or part that is not whole."""


class DaskMissing(StudyError):
    """Workers of a cluster without Dask installed."""


class SchedulerSilent(StudyError):
    """No Dask scheduler where one should be."""


class SchedulerGone(StudyError):
    """The scheduler that hands out the work has died."""

    def __init__(self) -> None:
        """Say how to go on."""
        super().__init__("the scheduler has exited; what is finished is kept, repeat the command")

    def __reduce__(self) -> tuple[type["SchedulerGone"], tuple[()]]:
        """Pickle without the message, which is always the same."""
        return type(self), ()


class UnfitWorker(StudyError):
    """A worker that cannot run trials, or would run others."""


class WorkersLost(StudyError):
    """Every worker is lost at its first task."""


class NotOurs(ScenarioError):
    """A file that a command would write over, although it did not write it, or not so."""


class NoFolder(ScenarioError):
    """A folder to write into that cannot be made."""


class OverInput(ScenarioError):
    """A file that a command would write over, although it reads it."""


class WrongFiles(ScenarioError):
    """Recordings and payloads on a command line that do not go together."""


class SaidTwice(ScenarioError):
    """Something that a file and the command line both say of a log."""


class WrongJointNames(ScenarioError):
    """Names of joints that a log is said to have, which cannot be those of the model."""


class NoJointWanted(ScenarioError):
    """A motion is searched for a scenario that wants no gain."""


class NothingCarried(ScenarioError):
    """A motion or payload is designed for a scenario that mounts no payload."""


class NoWeight(ScenarioError):
    """A payload is designed, and no weight may be mounted."""


class MotionTooFine(ScenarioError):
    """Harmonics that a search does not see between its samples."""


class OtherSeries(ScenarioError):
    """A motion that is to be improved is none of those that are searched."""


class NoFilm(ScenarioError):
    """A file of pictures whose kind is unknown, or cannot be written here."""


class ForeignResult(ScenarioError):
    """A folder that holds no result that a page could be made of, or one of another version."""


class UnfinishedResult(ScenarioError):
    """A folder of a study that is not finished."""


class DamagedResult(ScenarioError):
    """A folder of a result in which a file is missing, or another than it was."""


class ForeignProblem(ScenarioError):
    """A folder that is no problem, or says what cannot be."""


class UnknownMethod(ScenarioError):
    """A method of a comparison that does not exist, or does not take its options."""


class NothingToCompare(ScenarioError):
    """A comparison without methods or scenarios, or with one of them twice."""


class WrongSeal(ScenarioError):
    """A revealed truth that is not the one that was sealed, or answers that belong to no sealed problem."""


class ForeignAnswers(ScenarioError):
    """A file that holds no answers to problems."""


class SeenBefore(ScenarioError):
    """A recording that is to prove gains, or to be weighed with them, and that they were found from."""


class WrongGains(ScenarioError):
    """A file that holds no drive gains, or such as cannot be."""


class NotPatchable(ScenarioError):
    """A model file whose text cannot be changed in place."""


class WrongBareFile(ScenarioError):
    """A file that does not hold what was found from bare motions of this arm."""


class NoSuchMotion(ScenarioError):
    """A motion in a form that it cannot have: a rate, a robot, or joints without names."""


class MethodError(ScenarioError):
    """A call of a method that gave no answer: counted, never raised to the user."""


class MethodTimedOut(MethodError):
    """It took longer than it may."""


class MethodOutOfMemory(MethodError):
    """It wanted more memory than it may have."""


class MethodCrashed(MethodError):
    """It ended with an error or by a signal."""


class MethodNotStarted(MethodError):
    """It could not be started."""


class NoAnswer(MethodError):
    """What it said is no JSON object, or longer than any answer."""


class NotFinite(MethodError):
    """A number of its answer is not finite."""


class WrongForm(MethodError):
    """Its answer lacks a key, or a value is of another type."""


class WrongJoints(MethodError):
    """Its answer has not one gain for each joint, in their order."""


class ImpossibleGain(MethodError):
    """A gain of zero, a negative deviation, a gain that is refused and stated, or neither."""
