## For jobs that submit the next one themselves, by submit_again(): what follows exit code 5.

go_on() {
    echo "job: submitting the next job, to go on from the checkpoint"
    submit_again && exit 5
    echo "job: not done yet; submit the script again and it goes on from the checkpoint" >&2
    exit 5
}
