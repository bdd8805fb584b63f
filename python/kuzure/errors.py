"""What can go wrong, each with words that say what helps."""


class Error(Exception):
    """Every error of this package is one."""


class NoProgram(Error, FileNotFoundError):
    """The program `kuzure` is not where it was looked for."""


class NotARun(Error, FileNotFoundError):
    """A directory that is not there, or that no run or study left, or that lacks a file."""


class DamagedFile(Error, ValueError):
    """A file of a run that cannot be read."""


class ProgramFailed(Error):
    """The program ended with another exit code than 0.

    exit_code: 2 command line or scene wrong, 3 the numbers failed, 4 files failed, 5 stopped on request; negative: a signal ended it.
    message: its own words. directory: where results are, as far as the run came; None where nothing was asked for.
    """

    def __init__(self, command, exit_code, message, directory=None):
        self.command, self.exit_code, self.message, self.directory = command, exit_code, message.strip(), directory
        super().__init__(f"{command} ended with exit code {exit_code}: {self.message or 'it said nothing'}")
