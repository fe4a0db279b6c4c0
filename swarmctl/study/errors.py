"""What can go wrong with a study before it begins, said in one line to the person at the terminal."""


class StudyError(Exception):
    """A study cannot be done as asked; the message says why and what to do."""


class ClusterError(StudyError):
    """The cluster is not there, or would not give the results that this machine gives."""


class TuneError(StudyError):
    """There is nothing to tune, or the folder holds another question's trials."""
