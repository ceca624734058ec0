// What a manager of Flamenco 3 gives a job type's script, and nothing else: `author` with Task and Command, `print`,
// `path`, `process`, and a job with addTask. Reads {script, job}, writes {job_type, tasks}.
"use strict";
const vm = require("vm");
const { script, job } = JSON.parse(require("fs").readFileSync(0, "utf8"));
const tasks = [];

class Task {
    constructor(name, type) {
        if (typeof name !== "string" || !name.trim()) throw new Error("author.Task(name, type): name is required");
        if (typeof type !== "string" || !type.trim()) throw new Error("author.Task(name, type): type is required");
        Object.assign(this, { name, type, commands: [], dependencies: [] });
    }
    addCommand(command) {
        if (!(command instanceof Command)) throw new Error("addCommand takes a command");
        this.commands.push(command);
    }
    addDependency(task) {
        if (!(task instanceof Task)) throw new Error("addDependency takes a task");
        this.dependencies.push(task);
    }
}

class Command {
    constructor(name, parameters) { Object.assign(this, { name, parameters }); }
}

// The manager copies a task as it is added: what is done to it later is lost.
job.addTask = (task) => tasks.push({
    name: task.name, type: task.type, commands: task.commands.slice(), after: task.dependencies.map((one) => one.name),
});
const given = {
    author: { Task: (name, type) => new Task(name, type), Command: (name, parameters) => new Command(name, parameters) },
    print: () => {}, path: {}, process: {}, job,
};
vm.createContext(given);
vm.runInContext(script, given);
let error = null;
try {
    vm.runInContext("compileJob(job)", given);
} catch (thrown) {
    error = String(thrown);
}
process.stdout.write(JSON.stringify({ job_type: vm.runInContext("JOB_TYPE", given), tasks, error }));
